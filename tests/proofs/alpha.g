# The alpha form, one slab: A' = A + q((1 - A) alpha), C' = C + q(C_s (1 - A)): 1 - A plays T's part, exactly.
@q = fixed<-15, ne>;
alpha = q(a);
A = q(o);
Cs = q(k);
{ alpha in [0, 1] /\ A in [0, 1] /\ Cs in [0, 1]
  -> |q((1 - A) * alpha) - (1 - A) * alpha| <= 1b-16 /\ |q(Cs * (1 - A)) - Cs * (1 - A)| <= 1b-16 }
