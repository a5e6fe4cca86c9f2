/* What integrands as programs have of both types of numbers. */
enum {
    ADD, ADD_U, SUB, SUB_U, U_SUB, MUL, U_MUL, DIV, U_DIV,
    SUM, DOT2, DOT3, DOT4, DOT5, DOT6, U_DOT2, U_DOT3, U_DOT4, U_DOT5, FILL,
    POW, ATAN2, MIN, MAX, SQRT, ABS, SIGN, EXP, LOG, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH,
    TANH, ERF, LT, LE, GT, GE, EQ, NE, AND, OR, NOT, CHOOSE
};
