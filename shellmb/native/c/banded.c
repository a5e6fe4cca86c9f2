/* Factors of banded matrices by LAPACK, with partial pivoting. */
typedef void (*lapack_gbtrf)(int *, int *, int *, int *, double *, int *, int *, int *);
typedef void (*lapack_gbtrs)(char *, int *, int *, int *, int *, double *, int *, int *, double *,
                             int *, int *);

#define NO_PIVOT 1e-14

static lapack_gbtrf gbtrf;
static lapack_gbtrs gbtrs;

void use_banded(void *f, void *s)
{
    gbtrf = (lapack_gbtrf)f;
    gbtrs = (lapack_gbtrs)s;
}

/* For each row or column, one over the largest entry, each entry times the factor of its line. */
static void equilibrate(const Band *b, const double *values, const int *line, const int *other,
                        const double *factor, double *scale)
{
    for (int i = 0; i < b->size; ++i)
        scale[i] = 0.0;
    for (int k = 0; k < b->entries; ++k) {
        double size = fabs(values[k]) * (factor ? factor[other[k]] : 1.0);
        if (size > scale[line[k]])
            scale[line[k]] = size;
    }
    for (int i = 0; i < b->size; ++i)
        scale[i] = scale[i] > 0.0 ? 1.0 / scale[i] : 1.0;
}

/* Factorise; returns zero, or the number of a pivot that is none: of a matrix whose largest entries
 * are one it is round-off. */
int band_factorise(const Band *b, const double *values)
{
    int n = b->size, below = b->below, above = b->above, width = 2 * below + above + 1, info = 0;
    equilibrate(b, values, b->row, b->column, NULL, b->row_scale);
    equilibrate(b, values, b->column, b->row, b->row_scale, b->column_scale);
    memset(b->factors, 0, sizeof(double) * (size_t)n * width);
    for (int k = 0; k < b->entries; ++k)
        b->factors[b->place[k]] =
            values[k] * b->row_scale[b->row[k]] * b->column_scale[b->column[k]];
    gbtrf(&n, &n, &below, &above, b->factors, &width, b->pivots, &info);
    for (int i = 0; !info && i < n; ++i)
        if (!(fabs(b->factors[below + above + (size_t)i * width]) > NO_PIVOT))
            info = i + 1;
    return info;
}

/* Solve with the factors, of the matrix or its transpose; returns LAPACK's error. */
int band_solve(const Band *b, int transposed, const double *rhs, double *x)
{
    int n = b->size, below = b->below, above = b->above, width = 2 * below + above + 1;
    int one = 1, info = 0;
    char which = transposed ? 'T' : 'N';
    const double *before = transposed ? b->column_scale : b->row_scale;
    const double *behind = transposed ? b->row_scale : b->column_scale;
    for (int i = 0; i < n; ++i)
        b->work[b->order[i]] = rhs[i] * before[i];
    gbtrs(&which, &n, &below, &above, &one, b->factors, &width, b->pivots, b->work, &n, &info);
    for (int i = 0; i < n; ++i)
        x[i] = b->work[b->order[i]] * behind[i];
    return info;
}
