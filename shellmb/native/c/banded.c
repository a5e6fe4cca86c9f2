/* Factors of banded matrices with partial pivoting. Rows of a few dozen numbers are short for LAPACK,
 * which takes three times as long, and with blocks of rigid bodies and joints many numbers below the
 * diagonal are zero: their rows are passed over.
 *
 * Row i has its columns from i - below on; what eliminates the rows below a pivot is by itself, so that
 * all loops go through the memory in its order. */
#define NO_PIVOT 1e-14

/* For each row or column, one over the largest entry, each entry times the factor of its line. The
 * comparison is no branch, which would be foreseen wrongly. */
static void equilibrate(const Band *b, const double *values, const int *line, const int *other,
                        const double *factor, double *scale)
{
    for (int i = 0; i < b->size; ++i)
        scale[i] = 0.0;
    for (int k = 0; k < b->entries; ++k) {
        double size = fabs(values[k]) * (factor ? factor[other[k]] : 1.0), most = scale[line[k]];
        scale[line[k]] = size > most ? size : most;
    }
    for (int i = 0; i < b->size; ++i)
        scale[i] = scale[i] > 0.0 ? 1.0 / scale[i] : 1.0;
}

/* y += factor x, of so many numbers, made up to whole vectors of the processor: what is behind them in
 * a row or a column is zero. */
static inline void add_vectors(int count, double factor, const double *x, double *y)
{
    for (int j = 0; j < count; j += LANES)
        *(anywhere *)(y + j) += factor * *(const anywhere *)(x + j);
}

static inline double product_of(int count, const double *x, const double *y)
{
    lanes sums = {0.0};
    double sum = 0.0;
    for (int j = 0; j < count; j += LANES)
        sums += *(const anywhere *)(x + j) * *(const anywhere *)(y + j);
    for (int l = 0; l < LANES; ++l)
        sum += sums[l];
    return sum;
}

/* Eliminate column k below its pivot; returns how many columns the pivot's row has behind it. */
static int eliminate_column(const Band *b, int k, int *reach)
{
    int n = b->size, below = b->below, pivot = 0;
    int rows = n - 1 - k < below ? n - 1 - k : below;
    double *own = b->factors + (size_t)k * b->width + below;
    double *lower = b->lower + (size_t)k * b->height;
    /* entry (k + r, k) is so many numbers behind (k, k) */
    size_t down = b->width - 1;
    const double *entry = own;
    double most = fabs(*entry);
    for (int r = 1; r <= rows; ++r) {
        double size = fabs(*(entry += down));
        pivot = size > most ? r : pivot;
        most = size > most ? size : most;
    }
    b->pivots[k] = k + pivot;
    *reach = larger(*reach, k + pivot + b->above);
    int count = (*reach < n ? *reach : n - 1) - k;
    if (pivot)
        swap(count + 1, own, own + pivot * down);
    double one = 1.0 / own[0];
    for (int r = 1; r <= rows; ++r) {
        double *row = own + r * down;
        lower[r - 1] = row[0] * one;
        if (lower[r - 1] != 0.0)
            add_vectors(count, -lower[r - 1], own + 1, row + 1);
    }
    return count;
}

/* Factorise; returns zero, or the number of a pivot that is none: of a matrix whose largest entries
 * are one it is round-off. */
int band_factorise(const Band *b, const double *values)
{
    int n = b->size, reach = 0;
    equilibrate(b, values, b->row, b->column, NULL, b->row_scale);
    equilibrate(b, values, b->column, b->row, b->row_scale, b->column_scale);
    memset(b->factors, 0, sizeof(double) * (size_t)n * b->width);
    for (int k = 0; k < b->entries; ++k)
        b->factors[b->place[k]] =
            values[k] * b->row_scale[b->row[k]] * b->column_scale[b->column[k]];
    for (int k = 0; k < n; ++k) {
        b->counts[k] = eliminate_column(b, k, &reach);
        if (!(fabs(b->factors[(size_t)k * b->width + b->below]) > NO_PIVOT))
            return k + 1;
    }
    return 0;
}

/* Solve with the factors, of the matrix or its transpose. */
void band_solve(const Band *b, int transposed, const double *rhs, double *x)
{
    int n = b->size, below = b->below;
    const double *before = transposed ? b->column_scale : b->row_scale;
    const double *behind = transposed ? b->row_scale : b->column_scale;
    double *y = b->work;
    for (int i = 0; i < n; ++i)
        y[b->order[i]] = rhs[i] * before[i];
    for (int k = 0; k < n; ++k) {
        const double *row = b->factors + (size_t)k * b->width + below;
        if (transposed) {
            y[k] /= row[0];
            add_vectors(b->counts[k], -y[k], row + 1, y + k + 1);
        } else {
            swap(1, y + k, y + b->pivots[k]);
            add_vectors(below, -y[k], b->lower + (size_t)k * b->height, y + k + 1);
        }
    }
    for (int k = n - 1; k >= 0; --k) {
        const double *row = b->factors + (size_t)k * b->width + below;
        if (transposed) {
            y[k] -= product_of(below, b->lower + (size_t)k * b->height, y + k + 1);
            swap(1, y + k, y + b->pivots[k]);
        } else {
            y[k] = (y[k] - product_of(b->counts[k], row + 1, y + k + 1)) / row[0];
        }
    }
    for (int i = 0; i < n; ++i)
        x[i] = y[b->order[i]] * behind[i];
}
