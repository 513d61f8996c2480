# Form w, one slab: w = q(alpha T), T' = T - w, C' = C + q(c w).  rho and sigma are half a last bit, T' loses w and no
# more, and no word leaves [0, 1].
@q = fixed<-15, ne>;
alpha = q(a);
T = q(t);
c = q(k);
w = q(alpha * T);
{ alpha in [0, 1] /\ T in [0, 1] /\ c in [0, 1]
  -> |w - alpha * T| <= 1b-16 /\ |q(c * w) - c * w| <= 1b-16 /\ w in [0, 1] /\ q(T - w) - (T - w) in [0, 0] }
