# Form w_carry, one slab, in whole numbers of 15 fraction bits (docs/compositing.md):
#     s = alpha T + r,   w = floor(s / 2^15),   r' = s - 2^15 w:   0 <= r' < 2^15 and 0 <= w <= 2^15.
@floor = fixed<0, dn>;
A = floor(a);
T = floor(t);
R = floor(r);
u = (A * T + R) * 1b-15;
w = floor(u);
{ A in [0, 1b15] /\ T in [0, 1b15] /\ R in [0, 32767] -> w in [0, 32768] /\ w - u in [-0.999969482421875, 0] }
