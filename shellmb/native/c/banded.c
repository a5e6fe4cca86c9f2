/* Factors of banded matrices with partial pivoting. Rows of a few dozen numbers are short for LAPACK,
 * which takes three times as long, and with blocks of rigid bodies and joints many numbers below the
 * diagonal are zero: their rows are passed over.
 *
 * Row i has its columns from i - below on; what eliminates the rows below a pivot is by itself, so that
 * all loops go through the memory in its order. */
#define NO_PIVOT 1e-14

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

/* Eliminate column k below its pivot; returns how many columns the pivot's row has behind it. */
static int eliminate_column(const Band *b, int k, int *reach)
{
    int n = b->size, below = b->below, width = 2 * below + b->above + 1, pivot = 0;
    int rows = n - 1 - k < below ? n - 1 - k : below;
    double *own = b->factors + (size_t)k * width + below, *lower = b->lower + (size_t)k * below;
    /* entry (k + r, k) is so many numbers behind (k, k) */
    size_t down = width - 1;
    for (int r = 1; r <= rows; ++r)
        if (fabs(own[r * down]) > fabs(own[pivot * down]))
            pivot = r;
    b->pivots[k] = k + pivot;
    int last = k + pivot + b->above;
    *reach = last > *reach ? last : *reach;
    int count = (*reach < n ? *reach : n - 1) - k;
    double *other = own + pivot * down;
    for (int j = 0; pivot && j <= count; ++j) {
        double swapped = own[j];
        own[j] = other[j];
        other[j] = swapped;
    }
    double one = 1.0 / own[0];
    for (int r = 1; r <= rows; ++r) {
        double *row = own + r * down, factor = row[0] * one;
        lower[r - 1] = factor;
        if (factor == 0.0)
            continue;
        for (int j = 1; j <= count; ++j)
            row[j] -= factor * own[j];
    }
    return count;
}

/* Factorise; returns zero, or the number of a pivot that is none: of a matrix whose largest entries
 * are one it is round-off. */
int band_factorise(const Band *b, const double *values)
{
    int n = b->size, width = 2 * b->below + b->above + 1, reach = 0;
    equilibrate(b, values, b->row, b->column, NULL, b->row_scale);
    equilibrate(b, values, b->column, b->row, b->row_scale, b->column_scale);
    memset(b->factors, 0, sizeof(double) * (size_t)n * width);
    for (int k = 0; k < b->entries; ++k)
        b->factors[b->place[k]] =
            values[k] * b->row_scale[b->row[k]] * b->column_scale[b->column[k]];
    for (int k = 0; k < n; ++k) {
        b->counts[k] = eliminate_column(b, k, &reach);
        if (!(fabs(b->factors[(size_t)k * width + b->below]) > NO_PIVOT))
            return k + 1;
    }
    return 0;
}

static void exchange(double *x, int i, int j)
{
    double kept = x[i];
    x[i] = x[j];
    x[j] = kept;
}

/* Solve with the factors, of the matrix or its transpose. */
void band_solve(const Band *b, int transposed, const double *rhs, double *x)
{
    int n = b->size, below = b->below, width = 2 * below + b->above + 1;
    const double *before = transposed ? b->column_scale : b->row_scale;
    const double *behind = transposed ? b->row_scale : b->column_scale;
    double *y = b->work;
    for (int i = 0; i < n; ++i)
        y[b->order[i]] = rhs[i] * before[i];
    for (int k = 0; k < n; ++k) {
        const double *row = b->factors + (size_t)k * width + below, *lower = b->lower + (size_t)k * below;
        int rows = n - 1 - k < below ? n - 1 - k : below;
        if (transposed) {
            double found = y[k] /= row[0];
            for (int j = 1; j <= b->counts[k]; ++j)
                y[k + j] -= row[j] * found;
        } else {
            exchange(y, k, b->pivots[k]);
            for (int r = 0; r < rows; ++r)
                y[k + 1 + r] -= lower[r] * y[k];
        }
    }
    for (int k = n - 1; k >= 0; --k) {
        const double *row = b->factors + (size_t)k * width + below, *lower = b->lower + (size_t)k * below;
        int rows = n - 1 - k < below ? n - 1 - k : below;
        double sum = y[k];
        if (transposed) {
            for (int r = 0; r < rows; ++r)
                sum -= lower[r] * y[k + 1 + r];
            y[k] = sum;
            exchange(y, k, b->pivots[k]);
        } else {
            for (int j = 1; j <= b->counts[k]; ++j)
                sum -= row[j] * y[k + j];
            y[k] = sum / row[0];
        }
    }
    for (int i = 0; i < n; ++i)
        x[i] = y[b->order[i]] * behind[i];
}
