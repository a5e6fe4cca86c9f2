/* Loops over the cells of one mesh: kernels, elimination of element-wise unknowns, projection.
 *
 * Of the unknowns of a cell those that cells share come first, then the element-wise ones in chunks
 * E. With K the matrix of a cell, they are eliminated chunk after chunk,
 *
 *     K <- K - K_xE (K_EE)^-1 K_Ey        for all x, y that are shared or behind E,
 *
 * and what is left is projected, L^T K R, with a few coefficients per unknown (reduction.py).
 * All matrices are row-major.
 */

/* Functions of BLAS and LAPACK, and of PETSc: one that solves with factors, and those that lend the
 * numbers of vectors and take them back, to be read and to be changed. */
static void (*gemm)(char *, char *, int *, int *, int *, double *, double *, int *, double *, int *,
                    double *, double *, int *);
static void (*getrf)(int *, int *, double *, int *, int *, int *);
static void (*getri)(int *, double *, int *, int *, double *, int *, int *);
static int (*mat_solve)(void *, void *, void *);
static int (*array_of[2][2])(void *, double **);

void use_libraries(void **functions)
{
    gemm = functions[0];
    getrf = functions[1];
    getri = functions[2];
    mat_solve = functions[3];
    memcpy(array_of, functions + 4, sizeof(array_of));
}

/* C = beta C + alpha A B, of shapes (m, k) and (k, n), with leading dimensions */
static void multiply(int m, int n, int k, double alpha, double *A, int lda, double *B, int ldb,
                     double beta, double *C, int ldc)
{
    char no = 'N';
    if (m == 0 || n == 0 || k == 0)
        return;
    gemm(&no, &no, &n, &m, &k, &alpha, B, &ldb, A, &lda, &beta, C, &ldc);
}

/* Eliminate the element-wise unknowns of one cell, whose rows are `n` apart, and keep what solutions
 * need of them; `blocks` has its K_EE of which `known` has the K_EE^-1, kept before. */
static int eliminate(const Cells *g, double *K, int n, double *blocks, const double *known,
                     double *kept, double *work)
{
    int info = 0, pivots[256];
    for (int s = 0; s < g->chunks; ++s) {
        int E = g->chunk_start[s], e = g->chunk_width[s];
        double *inverse = kept + g->inverse_place[s], *block = blocks + g->block_place[s];
        /* that of a linear section is the same at all states, and its inverse is there */
        int changed = !known;
        for (int i = 0; i < e; ++i) {
            const double *row = K + (size_t)(E + i) * n + E;
            changed = changed || memcmp(block + i * e, row, sizeof(double) * e);
            memcpy(block + i * e, row, sizeof(double) * e);
        }
        if (changed) {
            memcpy(inverse, block, sizeof(double) * e * e);
            int length = e * 32;
            getrf(&e, &e, inverse, &e, pivots, &info);
            if (!info)
                getri(&e, inverse, &e, pivots, work, &length, &info);
            if (info)
                return 1;
        }
        for (int i = 0; i < e * e && !changed; ++i)
            inverse[i] = known[(g->inverse_place[s] + i) * LANES];
        const Runs *right = &g->right, *left = &g->left;
        int first = right->first[s], last = right->first[s + 1];
        for (int y = first; y < last; ++y)
            multiply(e, right->width[y], e, 1.0, inverse, e, K + (size_t)E * n + right->start[y], n,
                     0.0, kept + right->place[y], right->width[y]);
        for (int x = left->first[s]; x < left->first[s + 1]; ++x) {
            double *at = K + (size_t)left->start[x] * n;
            for (int i = 0; i < left->width[x]; ++i)
                memcpy(kept + left->place[x] + i * e, at + (size_t)i * n + E, sizeof(double) * e);
            for (int y = first; y < last; ++y)
                multiply(left->width[x], right->width[y], e, -1.0, at + E, n,
                         kept + right->place[y], right->width[y], 1.0, at + right->start[y], n);
        }
    }
    return 0;
}

typedef struct {
    int rows, columns, own;
} Widths;

static Widths widths_of(const Inner *inner, int group)
{
    const int *w = inner->widths + 3 * group;
    return (Widths){w[0], w[1], w[2]};
}

/* What is kept of a cell. */
static size_t inner_kept(int rows, int columns, int own)
{
    return (size_t)own * (own + columns + rows);
}

/* A matrix of one cell, (rows, columns), among those of a group, which are wider. */
static void widen(int rows, int columns, int width, const double *A, double *to)
{
    for (int i = 0; i < rows; ++i)
        memcpy(to + i * width, A + i * columns, sizeof(double) * columns);
}

/* Eliminate what is left of one cell's unknowns that no other cell shares; they come last. What
 * solutions need of them is `kept`, as wide as that of its group. */
static int eliminate_inner(const Projection *p, int cell, double *K, double *kept, double *work)
{
    int q = p->inner_size[cell], info = 0, pivots[256];
    if (q == 0)
        return 0;
    int rows = p->outer_rows[cell], columns = p->outer_columns[cell], n = p->right.rows;
    double *inverse = work + 32 * q, *right = inverse + q * q, *left = right + q * columns;
    for (int i = 0; i < q; ++i)
        memcpy(inverse + i * q, K + (size_t)(rows + i) * n + columns, sizeof(double) * q);
    int length = q * 32;
    getrf(&q, &q, inverse, &q, pivots, &info);
    if (info)
        return 1;
    getri(&q, inverse, &q, pivots, work, &length, &info);
    if (info)
        return 1;
    multiply(q, columns, q, 1.0, inverse, q, K + (size_t)rows * n, n, 0.0, right, columns);
    for (int i = 0; i < rows; ++i)
        memcpy(left + i * q, K + (size_t)i * n + columns, sizeof(double) * q);
    multiply(rows, columns, q, -1.0, left, q, right, columns, 1.0, K, n);
    for (int i = 0; i < q; ++i)
        memset(K + (size_t)(rows + i) * n, 0, sizeof(double) * (columns + q));
    for (int i = 0; i < rows; ++i)
        memset(K + (size_t)i * n + columns, 0, sizeof(double) * q);
    Widths w = widths_of(p->inner, cell / LANES);
    widen(q, q, w.own, inverse, kept);
    widen(q, columns, w.columns, right, kept + w.own * w.own);
    widen(rows, q, w.own, left, kept + w.own * (w.own + w.columns));
    return 0;
}

/* Coefficients of the terms of a cell; returns the first term of its first row. */
static int take_coefficients(const Terms *t, int cell, double *c)
{
    const int *begin = t->begin + (size_t)cell * t->rows;
    for (int k = begin[0]; k < begin[t->rows]; ++k)
        *c++ = t->values[t->at[k]];
    return begin[0];
}

/* Sums of `some` vectors or rows at a time, which is a constant for the compiler: loops over them are
 * unrolled, and sums stay in registers. */
enum { MANY = 8 };
#define SOME(k) _Pragma("GCC unroll 8") for (int k = 0; k < some; ++k)
#define CASE(some, call)                                                                           \
    case some:                                                                                     \
        call;                                                                                      \
        break;
#define CASES(of)                                                                                  \
    CASE(1, of(1)) CASE(2, of(2)) CASE(3, of(3)) CASE(4, of(4)) CASE(5, of(5)) CASE(6, of(6))      \
    CASE(7, of(7)) CASE(8, of(8))

/* Vectors of a sum of rows of A, which are `n` apart, each times a coefficient; `width` numbers of
 * them are put. */
static ALWAYS void sum_of_rows(int some, int terms, const int *from, const double *c, const double *A,
                               int n, double *out, int width)
{
    lanes sums[MANY];
    SOME(k) sums[k] = (lanes){0.0};
    for (int q = 0; q < terms; ++q) {
        const double *a = A + (size_t)from[q] * n;
        SOME(k) sums[k] += c[q] * *(const anywhere *)(a + k * LANES);
    }
    if (width < some * LANES)
        memcpy(out, sums, sizeof(double) * width);
    else
        SOME(k) *(anywhere *)(out + k * LANES) = sums[k];
}

/* Rows of combinations: `width` numbers of rows of A, which are `n` apart and have room for whole
 * vectors. `c` has room for the coefficients. */
static void combine_rows(const Terms *t, int cell, int width, const double *A, int n, double *out,
                         double *c)
{
    const int *begin = t->begin + (size_t)cell * t->rows;
    const int *from = t->from + take_coefficients(t, cell, c);
    for (int row = 0; row < t->rows; ++row, out += width) {
        int terms = begin[row + 1] - begin[row];
        for (int j = 0; j < width; j += MANY * LANES) {
            int left = width - j < MANY * LANES ? width - j : MANY * LANES;
            int some = (left + LANES - 1) / LANES;
            /* what is behind a row is overwritten by the next ones */
            int whole = (t->rows - row) * width - j >= some * LANES;
            int put = whole ? some * LANES : left;
#define ROWS(some) sum_of_rows(some, terms, from, c, A + j, n, out + j, put)
            switch (some) {
                CASES(ROWS)
            }
        }
        from += terms;
        c += terms;
    }
}

/* Columns of combinations of some rows of A, which are `n` apart. */
static ALWAYS void sums_of_columns(int some, int columns, const int *begin, const int *from,
                                   const double *c, const double *A, size_t n, double *out)
{
    for (int j = 0; j < columns; ++j) {
        double sums[MANY];
        SOME(k) sums[k] = 0.0;
        for (int q = begin[j]; q < begin[j + 1]; ++q, ++c) {
            const double *x = A + *from++;
            SOME(k) sums[k] += x[k * n] * *c;
        }
        SOME(k) out[k * columns + j] = sums[k];
    }
}

/* Columns of combinations; `c` has room for the coefficients. */
static void combine_columns(const Terms *t, int cell, int rows, const double *A, int n, double *out,
                            double *c)
{
    const int *begin = t->begin + (size_t)cell * t->rows;
    const int *from = t->from + take_coefficients(t, cell, c);
    for (int i = 0; i < rows; i += MANY, A += MANY * (size_t)n, out += MANY * (size_t)t->rows) {
#define COLUMNS(some) sums_of_columns(some, t->rows, begin, from, c, A, n, out)
        switch (rows - i < MANY ? rows - i : MANY) {
            CASES(COLUMNS)
        }
    }
}

static int larger(int a, int b)
{
    return a > b ? a : b;
}

/* Jacobian of all cells, reduced.
 *
 * values: of the reduced matrix, put and added together by `p->runs`.
 * blocks: of all cells, for `eliminate`; first, last: which cells, the first one of a group.
 * shift: given change of the local unknowns, or NULL; `load` gets K shift.
 * Returns 1 + the number of a cell whose element-wise block is singular, or 0.
 */
int jacobian(const Cells *g, const Kernel *kernels, int count, const Projection *p, int first,
             int last, double *blocks, double *values, const double *shift, double *load)
{
    /* rows are whole vectors */
    int size = g->size, n = (size + LANES - 1) / LANES * LANES, P = g->shared, bad = 0;
    int rows = p->left.rows, columns = p->right.rows;
    size_t square = (size_t)size * n, product = (size_t)P * rows, result = (size_t)rows * columns;
    size_t kept_size = g->kept_size, most = larger(rows, columns);
    size_t listed = larger(larger(p->left.most, p->right.most), p->multiplier.most);
    size_t some = 64 * (size_t)n + 64 + listed + 3 * most * most;
    const Inner *inner = p->inner;
    size_t inner_size = inner ? inner_kept(inner->most_rows, inner->most_columns, inner->most) : 0;
    Work work = work_of(g, square, square * g->lanes + product + result + some +
                                       LANES * (kept_size + inner_size));
    double *all = work.more, *LK = all + square * g->lanes, *LKR = LK + product;
    double *scratch = LKR + result, *kept = scratch + some, *kept_inner = kept + LANES * kept_size;
    for (int cell = first; cell < last; ++cell) {
        int lane = cell % g->lanes, start = cell - lane;
        if (lane == 0 || cell == first)
            matrices(g, kernels, count, start, taken(g, start), work, all, n);
        double *K = all + lane * square;
        /* without element-wise unknowns, cells stand one after the other */
        int alone = p->kept && P == size;
        double *mine = alone ? p->kept + cell * kept_size : kept + cell % LANES * kept_size;
        /* cells that are missing in the last group have zeros, as has what others have more */
        if (!alone && cell == g->cells - 1)
            memset(mine + kept_size, 0, sizeof(double) * (LANES - 1 - cell % LANES) * kept_size);
        if (inner && (cell % LANES == 0 || cell == first)) {
            Widths w = widths_of(inner, cell / LANES);
            inner_size = inner_kept(w.rows, w.columns, w.own);
            memset(kept_inner, 0, sizeof(double) * LANES * inner_size);
        }
        const double *known = p->kept ? p->kept + cell / LANES * kept_size * LANES + cell % LANES : 0;
        if (eliminate(g, K, n, blocks + (size_t)cell * g->block_size, known, mine, scratch)) {
            bad = cell + 1;
            break;
        }
        const int *dofs = g->dofs + (size_t)cell * size;
        if (shift) {
            for (int j = 0; j < P; ++j)
                scratch[j] = shift[dofs[j]];
            for (int i = 0; i < P; ++i) {
                double sum = 0.0;
                for (int j = 0; j < P; ++j)
                    sum += K[(size_t)i * n + j] * scratch[j];
                load[dofs[i]] += sum;
            }
        }
        /* rows first: they are combined whole, and few are left for the columns */
        combine_rows(&p->left, cell, P, K, n, LK, scratch);
        combine_columns(&p->right, cell, rows, LK, P, LKR, scratch);
        double *inner_of_mine = kept_inner + cell % LANES * inner_size;
        if (inner && eliminate_inner(p, cell, LKR, inner_of_mine, scratch)) {
            bad = cell + 1;
            break;
        }
        const int *run = p->runs + 3 * (size_t)p->run_offsets[2 * cell];
        const int *added = p->runs + 3 * (size_t)p->run_offsets[2 * cell + 1];
        const int *end = p->runs + 3 * (size_t)p->run_offsets[2 * cell + 2];
        for (; run < added; run += 3)
            for (int q = 0; q < run[2]; ++q)
                values[run[1] + q] = LKR[run[0] + q];
        for (; run < end; run += 3)
            for (int q = 0; q < run[2]; ++q)
                values[run[1] + q] += LKR[run[0] + q];
        /* rows of the multipliers at the nodes */
        combine_rows(&p->multiplier, cell, P, K, n, mine + g->multiplier_place, scratch);
        if (p->kept && (cell % LANES == LANES - 1 || cell == last - 1)) {
            if (!alone)
                put_together(kept_size, kept, p->kept + cell / LANES * kept_size * LANES);
            if (inner)
                put_together(inner_size, kept_inner, inner->kept + inner->place[cell / LANES] * LANES);
        }
    }
    /* no inverses of these are kept */
    if (bad || !p->kept)
        memset(blocks + (size_t)first * g->block_size, 0xff,
               sizeof(double) * (last - first) * g->block_size);
    return bad;
}

/* So many numbers of LANES cells, in whole lines of the memory. */
static lanes *many_lanes(int count)
{
    return aligned_alloc(64, sizeof(lanes) * count / 64 * 64 + 64);
}

/* Numbers from their places, (count, LANES), zero where there is none. */
static void gather(int count, const int *at, const double *from, lanes *out)
{
    for (int i = 0; i < count; ++i)
        for (int l = 0; l < LANES; ++l)
            out[i][l] = at[i * LANES + l] < 0 ? 0.0 : from[at[i * LANES + l]];
}

/* Numbers to their places. */
static void put(int count, const int *at, const lanes *values, double *to)
{
    for (int i = 0; i < count; ++i)
        for (int l = 0; l < LANES; ++l)
            if (at[i * LANES + l] >= 0)
                to[at[i * LANES + l]] = values[i][l];
}

/* Numbers added at their places. */
static void add(int count, const int *at, const lanes *values, double *to)
{
    for (int i = 0; i < count; ++i)
        for (int l = 0; l < LANES; ++l)
            if (at[i * LANES + l] >= 0)
                to[at[i * LANES + l]] += values[i][l];
}
