/* What integrands as programs have of both types of numbers. */
enum {
    ADD, ADD_U, SUB, SUB_U, U_SUB, MUL, U_MUL, DIV, U_DIV,
    SUM, DOT2, DOT3, DOT4, DOT5, DOT6, U_DOT2, U_DOT3, U_DOT4, U_DOT5, FILL,
    POW, ATAN2, MIN, MAX, SQRT, ABS, SIGN, EXP, LOG, SIN, COS, TAN, ASIN, ACOS, ATAN, SINH, COSH,
    TANH, ERF, LT, LE, GT, GE, EQ, NE, AND, OR, NOT, CHOOSE
};

/* Operations on numbers that all cells and points have. */
static void operate_uniform(int count, const Instruction *code, double *u)
{
    for (const Instruction *k = code; k < code + count; ++k) {
        double x = u[k->a], y = u[k->b], *to = u + k->to;
        switch (k->op) {
        case ADD: *to = x + y; break;
        case SUB: *to = x - y; break;
        case MUL: *to = x * y; break;
        case DIV: *to = x / y; break;
        case POW: *to = pow(x, y); break;
        case ATAN2: *to = atan2(x, y); break;
        case MIN: *to = y < x ? y : x; break;
        case MAX: *to = y > x ? y : x; break;
        case SQRT: *to = sqrt(x); break;
        case ABS: *to = fabs(x); break;
        case SIGN: *to = (x > 0) - (x < 0); break;
        case EXP: *to = exp(x); break;
        case LOG: *to = log(x); break;
        case SIN: *to = sin(x); break;
        case COS: *to = cos(x); break;
        case TAN: *to = tan(x); break;
        case ASIN: *to = asin(x); break;
        case ACOS: *to = acos(x); break;
        case ATAN: *to = atan(x); break;
        case SINH: *to = sinh(x); break;
        case COSH: *to = cosh(x); break;
        case TANH: *to = tanh(x); break;
        case ERF: *to = erf(x); break;
        case LT: *to = x < y; break;
        case LE: *to = x <= y; break;
        case GT: *to = x > y; break;
        case GE: *to = x >= y; break;
        case EQ: *to = x == y; break;
        case NE: *to = x != y; break;
        case AND: *to = x != 0 && y != 0; break;
        case OR: *to = x != 0 || y != 0; break;
        case NOT: *to = x == 0; break;
        case CHOOSE: *to = x != 0 ? y : u[k->c]; break;
        }
    }
}
