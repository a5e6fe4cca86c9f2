/* What integrands as programs have of both types of numbers: functions of one number, and comparisons. */
#define FUNCTIONS(of)                                                                              \
    of(SQRT, sqrt) of(ABS, fabs) of(EXP, exp) of(LOG, log) of(SIN, sin) of(COS, cos) of(TAN, tan)  \
    of(ASIN, asin) of(ACOS, acos) of(ATAN, atan) of(SINH, sinh) of(COSH, cosh) of(TANH, tanh)      \
    of(ERF, erf)
#define COMPARISONS(of) of(LT, <) of(LE, <=) of(GT, >) of(GE, >=) of(EQ, ==) of(NE, !=)
