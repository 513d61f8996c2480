# Back to front, one slab: C' = C_s + q(C (1 - alpha)); what is behind is dimmed, and rounded once.
@q = fixed<-15, ne>;
alpha = q(a);
C = q(k);
y = fixed<-15, ne>(C * (1 - alpha));
{ alpha in [0, 1] /\ C in [0, 1] -> |y - C * (1 - alpha)| <= 1b-16 /\ y in [0, 1] }
