# Equation 9, one slab: C' = C + q(C_s T), C_s = q(c alpha), T' = q(T (1 - alpha)).  mu, sigma and rho are half a last bit.
@q = fixed<-15, ne>;
alpha = q(a);
T = q(t);
c = q(k);
Cs = q(c * alpha);
{ alpha in [0, 1] /\ T in [0, 1] /\ c in [0, 1]
  -> |Cs - c * alpha| <= 1b-16 /\ |q(Cs * T) - Cs * T| <= 1b-16 /\ |q(T * (1 - alpha)) - T * (1 - alpha)| <= 1b-16 }
