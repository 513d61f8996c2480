# 1.0 is 255: a product shifted by eight bits is low by up to one, and 255 times 255 gives 254.
@floor = fixed<0, dn>;
X = floor(x);
Y = floor(y);
p = floor(X * Y * 1b-8);
{ X in [0, 255] /\ Y in [0, 255] -> p in [0, 254] /\ p - X * Y * 1b-8 in [-0.99609375, 0] }
