# A quotient of words against that without rounding: (dN - q dD) / D, and half a last bit.
@q = fixed<-15, ne>;
x = q(N / D);
y = n / d;
{ |N - n| <= 1b-20 /\ |D - d| <= 1b-20 /\ D in [1b-4, 1] /\ d in [1b-4, 1] /\ n / d in [0, 1] -> |x - y| <= 0x1.8p-15 }
N / D - n / d -> ((N - n) - (n / d) * (D - d)) / D { D <> 0, d <> 0 };
