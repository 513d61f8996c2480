#!/usr/bin/env python3
"""The quadratic of Guetat et al. in powers, as printed, and in Bernstein form, in words of 12 to 18 bits.

    bench/nlpi_forms.py [--slabs 4000]

Even white matter of depth 0.1 to 4 between unit normals up to 90 degrees apart, lit from anywhere in front of both.  Tables (int m u^k du, or
int m b_k du) and coefficients are rounded to F fraction bits, their sum of products once more.  Prints Markdown: the largest and the rms
error against doubles, of 255, and the largest coefficient, which the words must hold.
"""
import argparse
import math
import random


def powers(x):
    """int_0^1 u^k x e^(-x u) du, k = 0 to 3, by quadrature that cancels nothing."""
    node = [(0.5 + i) / 400 for i in range(400)]
    return [sum(u**k * x * math.exp(-x * u) for u in node) / 400 for k in range(4)]


def rounded(value, bits):
    return math.floor(value * 2**bits + 0.5)


def draw(random_):
    while True:
        angle = random_.uniform(0, math.pi / 2)
        theta, phi = math.acos(random_.uniform(-1, 1)), random_.uniform(0, 2 * math.pi)
        light = (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))
        front, back = light[2], light[0] * math.sin(angle) + light[2] * math.cos(angle)
        if front > 0 and back > 0:
            return random_.uniform(0.1, 4), angle, front, back


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--slabs", type=int, default=4000)
    slabs = parser.parse_args().slabs
    print("| bits | powers: largest, rms | Bernstein: largest, rms | largest coefficient |\n|---|---|---|---|")
    for bits in (12, 14, 15, 16, 18):
        source, worst, square, largest = random.Random(1), [0, 0], [0, 0], [0, 0]
        for _ in range(slabs):
            x, angle, front, back = draw(source)
            h = 2 / math.cos(angle / 2) - 1
            i = powers(x)
            bernstein = [front, (2 * h * front + back) / 3, (front + 2 * h * back) / 3, back]
            moments = [i[0] - 3 * i[1] + 3 * i[2] - i[3], 3 * (i[1] - 2 * i[2] + i[3]), 3 * (i[2] - i[3]), i[3]]
            # sum b_k C(3, k) u^k (1 - u)^(3 - k) in powers of u
            b = bernstein
            power = [b[0], 3 * (b[1] - b[0]), 3 * (b[2] - 2 * b[1] + b[0]), b[3] - 3 * b[2] + 3 * b[1] - b[0]]
            exact = sum(c * m for c, m in zip(bernstein, moments))
            for form, (coefficients, table) in enumerate(((power, i), (bernstein, moments))):
                words = [rounded(t, bits) for t in table]
                if form == 1:  # what the others leave of the slab
                    words[0] = rounded(i[0], bits) - sum(words[1:])
                total = sum(rounded(c, bits) * t for c, t in zip(coefficients, words))
                error = 255 * abs((total + 2 ** (bits - 1) >> bits) / 2**bits - exact)
                worst[form], square[form] = max(worst[form], error), square[form] + error**2
                largest[form] = max(largest[form], *(abs(c) for c in coefficients))
        cells = [f"{worst[f]:.4f}, {math.sqrt(square[f] / slabs):.4f}" for f in (0, 1)]
        print(f"| {bits} | {cells[0]} | {cells[1]} | {largest[0]:.2f}, {largest[1]:.2f} |")


if __name__ == "__main__":
    main()
