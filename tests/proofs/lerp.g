# A lerp of words, v0 + w (v1 - v0) rounded once, against the lerp without rounding: a contraction in its two values (2^-4
# stays 2^-4, but for what 512 pieces of the weight cannot tell), the weight's error 2^-13 times how far they are apart,
# and half a last bit.
@q = fixed<-12, ne>;
x = q(V0 + W * (V1 - V0));
y = v0 + w * (v1 - v0);
{ W in [0, 1] /\ |V0 - v0| <= 1b-4 /\ |V1 - v1| <= 1b-4 /\ |W - w| <= 1b-13 /\ |v1 - v0| <= 4095 -> |x - y| <= 0.5635 }
x - y -> (x - (V0 + W * (V1 - V0))) + ((1 - W) * (V0 - v0) + W * (V1 - v1) + (W - w) * (v1 - v0));
$ W in 512;
