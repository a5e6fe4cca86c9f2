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
typedef void (*blas_gemm)(char *, char *, int *, int *, int *, double *, double *, int *, double *,
                          int *, double *, double *, int *);
typedef void (*lapack_getrf)(int *, int *, double *, int *, int *, int *);
typedef void (*lapack_getri)(int *, double *, int *, int *, double *, int *, int *);
typedef void (*lapack_gesv)(int *, int *, double *, int *, int *, double *, int *, int *);

static blas_gemm gemm;
static lapack_getrf getrf;
static lapack_getri getri;
static lapack_gesv gesv;

void use_libraries(void *f, void *g, void *h, void *s)
{
    gemm = (blas_gemm)f;
    getrf = (lapack_getrf)g;
    getri = (lapack_getri)h;
    gesv = (lapack_gesv)s;
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

/* Eliminate the element-wise unknowns of one cell, and keep what solutions need of them; `blocks`
 * has its K_EE^-1 and K_EE. */
static int eliminate(const Cells *g, double *K, double *blocks, double *kept, double *work)
{
    int n = g->size, info = 0;
    int pivots[256];
    for (int s = 0; s < g->chunks; ++s) {
        int E = g->chunk_start[s], e = g->chunk_width[s];
        double *inverse = blocks + g->block_place[s], *block = inverse + e * e;
        /* that of a linear section is the same at all states, and its inverse is there */
        int changed = 0;
        for (int i = 0; i < e; ++i) {
            const double *row = K + (size_t)(E + i) * n + E;
            changed = changed || memcmp(block + i * e, row, sizeof(double) * e);
            if (changed)
                memcpy(block + i * e, row, sizeof(double) * e);
        }
        if (changed) {
            memcpy(inverse, block, sizeof(double) * e * e);
            int length = e * 32;
            getrf(&e, &e, inverse, &e, pivots, &info);
            if (!info)
                getri(&e, inverse, &e, pivots, work, &length, &info);
            if (info) {
                block[0] = 0.0 / 0.0;
                return 1;
            }
        }
        memcpy(kept + g->inverse_place[s], inverse, sizeof(double) * e * e);
        int first = g->right_runs[s], last = g->right_runs[s + 1];
        for (int y = first; y < last; ++y)
            multiply(e, g->right_width[y], e, 1.0, inverse, e,
                     K + (size_t)E * n + g->right_start[y], n, 0.0, kept + g->right_place[y],
                     g->right_width[y]);
        for (int x = g->left_runs[s]; x < g->left_runs[s + 1]; ++x) {
            int rows = g->left_width[x];
            double *at = K + (size_t)g->left_start[x] * n, *left = kept + g->left_place[x];
            for (int i = 0; i < rows; ++i)
                memcpy(left + i * e, at + (size_t)i * n + E, sizeof(double) * e);
            for (int y = first; y < last; ++y)
                multiply(rows, g->right_width[y], e, -1.0, at + E, n, kept + g->right_place[y],
                         g->right_width[y], 1.0, at + g->right_start[y], n);
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
    int rows = p->outer_rows[cell], columns = p->outer_columns[cell], n = p->columns;
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

/* Most unknowns that one of a cell is a combination of, or that it is combined in. */
static int widest(const Projection *p)
{
    int width = p->right_width > p->left_width ? p->right_width : p->left_width;
    return width > p->multiplier_width ? width : p->multiplier_width;
}

/* What the unknowns of a cell are combined of: which goes to which of the `places`, and how much. */
static int list_terms(int count, const int *dofs, const int *places, const double *values, int width,
                      int *from, int *to, double *c)
{
    int terms = 0;
    for (int i = 0; i < count; ++i) {
        const double *own = values + (size_t)dofs[i] * width;
        for (int q = 0; q < width; ++q) {
            int at = places[i * width + q];
            if (at >= 0 && own[q] != 0.0) {
                from[terms] = i;
                to[terms] = at;
                c[terms++] = own[q];
            }
        }
    }
    return terms;
}

/* Sums of rows of `width` numbers, of a matrix of `n` columns, each times a coefficient: so many terms
 * with the row that it goes to and the one that it comes from. All rows of `out` get their sums, of
 * a few vectors of the processor at a time; `work` has room for three integers of each term and one
 * of each row of `out`. */
static void add_rows(int terms, const int *to, const int *from, const double *c, int rows, int width,
                     const double *A, int n, double *out, int *work)
{
    enum { FEW = 4 };
    int *ends = work, *order = work + rows + 1;
    memset(ends, 0, sizeof(int) * (rows + 1));
    for (int t = 0; t < terms; ++t)
        ++ends[to[t] + 1];
    for (int row = 0; row < rows; ++row)
        ends[row + 1] += ends[row];
    /* by the row that they go to; `ends` moves to where each ends */
    for (int t = 0; t < terms; ++t)
        order[ends[to[t]]++] = t;
    for (int row = 0, first = 0; row < rows; first = ends[row++]) {
        double *sum = out + (size_t)row * width;
        int j = 0;
        for (; j + FEW * LANES <= width; j += FEW * LANES) {
            lanes sums[FEW] = {{0.0}};
            for (int t = first; t < ends[row]; ++t) {
                const double *a = A + (size_t)from[order[t]] * n + j;
                for (int k = 0; k < FEW; ++k)
                    sums[k] += c[order[t]] * *(const anywhere *)(a + k * LANES);
            }
            for (int k = 0; k < FEW; ++k)
                *(anywhere *)(sum + j + k * LANES) = sums[k];
        }
        while (j < width) {
            /* the last ones once more with those before, where they fill no vector */
            int whole = width >= LANES;
            j = whole && j + LANES > width ? width - LANES : j;
            lanes part = {0.0};
            double one = 0.0;
            for (int t = first; t < ends[row]; ++t) {
                const double *a = A + (size_t)from[order[t]] * n + j;
                if (whole)
                    part += c[order[t]] * *(const anywhere *)a;
                else
                    one += c[order[t]] * *a;
            }
            if (whole)
                *(anywhere *)(sum + j) = part;
            else
                sum[j] = one;
            j += whole ? LANES : 1;
        }
    }
}

/* Jacobian of all cells, reduced.
 *
 * values: of the reduced matrix, put and added together by `p->runs`; or entries in the order of
 * `p->emitted`; or, without both (to find the pattern), all of them, cell after cell.
 * blocks: of all cells, for `eliminate`; first, last: which cells, the first one of a group.
 * shift: given change of the local unknowns, or NULL; `load` gets K shift.
 * Returns 1 + the number of a cell whose element-wise block is singular, or 0.
 */
int jacobian(const Cells *g, const Kernel *kernels, int count, const Projection *p, int first,
             int last, double *blocks, double *values, const double *shift, double *load)
{
    int n = g->size, P = g->shared, bad = 0;
    size_t square = (size_t)n * n;
    size_t product = (size_t)P * p->rows, result = (size_t)p->rows * p->columns;
    size_t kept_size = g->kept_size, most = p->rows > p->columns ? p->rows : p->columns;
    size_t listed = P * (size_t)widest(p), some = 64 * (size_t)n + 64 + listed + 3 * most * most;
    size_t places_size = listed + 1 + (most > (size_t)g->multipliers ? most : g->multipliers);
    const Inner *inner = p->inner;
    size_t inner_size = inner ? inner_kept(inner->most_rows, inner->most_columns, inner->most) : 0;
    Work work = work_of(g, square, square * g->lanes + product + result + some +
                                       LANES * (kept_size + inner_size) + 2 * listed + places_size);
    double *all = work.more, *LK = all + square * g->lanes, *LKR = LK + product;
    double *scratch = LKR + result, *kept = scratch + some, *kept_inner = kept + LANES * kept_size;
    int *from = (int *)(kept_inner + LANES * inner_size), *to_one = from + listed;
    int *places = to_one + listed;
    double *to = values;
    for (int cell = first; cell < last; ++cell) {
        int lane = cell % g->lanes, start = cell - lane;
        if (lane == 0 || cell == first)
            matrices(g, kernels, count, start, taken(g, start), work, all);
        double *K = all + lane * square;
        double *mine = kept + cell % LANES * kept_size;
        /* cells that are missing in the last group have zeros, as has what others have more */
        if (cell == g->cells - 1)
            memset(mine + kept_size, 0, sizeof(double) * (LANES - 1 - cell % LANES) * kept_size);
        if (inner && (cell % LANES == 0 || cell == first)) {
            Widths w = widths_of(inner, cell / LANES);
            inner_size = inner_kept(w.rows, w.columns, w.own);
            memset(kept_inner, 0, sizeof(double) * LANES * inner_size);
        }
        if (eliminate(g, K, blocks + (size_t)cell * g->block_size, mine, scratch)) {
            bad = cell + 1;
            break;
        }
        const int *dofs = g->dofs + (size_t)cell * n;
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
        const int *left = p->left + (size_t)cell * P * p->left_width;
        int terms = list_terms(P, dofs, left, p->left_values, p->left_width, from, to_one, scratch);
        add_rows(terms, to_one, from, scratch, p->rows, P, K, n, LK, places);
        /* columns: for four rows at a time: sums of one alone would wait for one another */
        const int *right = p->right + (size_t)cell * P * p->right_width;
        terms = list_terms(P, dofs, right, p->right_values, p->right_width, from, to_one, scratch);
        memset(LKR, 0, sizeof(double) * result);
        int i = 0, width = p->columns;
        for (; i + 4 <= p->rows; i += 4) {
            const double *row = LK + (size_t)i * P;
            double *out = LKR + (size_t)i * width;
            for (int q = 0; q < terms; ++q) {
                double c = scratch[q];
                const double *x = row + from[q];
                double *y = out + to_one[q];
                y[0] += x[0] * c;
                y[width] += x[P] * c;
                y[2 * width] += x[2 * P] * c;
                y[3 * width] += x[3 * P] * c;
            }
        }
        for (; i < p->rows; ++i)
            for (int q = 0; q < terms; ++q)
                LKR[(size_t)i * width + to_one[q]] += LK[(size_t)i * P + from[q]] * scratch[q];
        double *inner_of_mine = kept_inner + cell % LANES * inner_size;
        if (inner && eliminate_inner(p, cell, LKR, inner_of_mine, scratch)) {
            bad = cell + 1;
            break;
        }
        if (p->runs) {
            const int *run = p->runs + 3 * (size_t)p->run_offsets[2 * cell];
            const int *added = p->runs + 3 * (size_t)p->run_offsets[2 * cell + 1];
            const int *end = p->runs + 3 * (size_t)p->run_offsets[2 * cell + 2];
            for (; run < added; run += 3)
                for (int q = 0; q < run[2]; ++q)
                    values[run[1] + q] = LKR[run[0] + q];
            for (; run < end; run += 3)
                for (int q = 0; q < run[2]; ++q)
                    values[run[1] + q] += LKR[run[0] + q];
        } else if (p->emitted) {
            int list = p->list[cell], length = p->emitted_offsets[list + 1];
            length -= p->emitted_offsets[list];
            const int *emitted = p->emitted + p->emitted_offsets[list];
            for (int q = 0; q < length; ++q)
                *to++ = LKR[emitted[q]];
        } else {
            memcpy(to, LKR, sizeof(double) * result);
            to += result;
        }
        /* rows of the multipliers at the nodes */
        const int *multiplier = p->multiplier + (size_t)cell * P * p->multiplier_width;
        terms = list_terms(P, dofs, multiplier, p->multiplier_values, p->multiplier_width, from, to_one,
                           scratch);
        add_rows(terms, to_one, from, scratch, g->multipliers, P, K, n, mine + g->multiplier_place,
                 places);
        if (p->kept && (cell % LANES == LANES - 1 || cell == last - 1)) {
            size_t place = cell / LANES * kept_size * LANES;
            float *single = p->kept_single ? p->kept_single + place : NULL;
            put_together(kept_size, kept, p->kept + place, single);
            if (inner) {
                place = inner->place[cell / LANES] * LANES;
                single = inner->kept_single ? inner->kept_single + place : NULL;
                put_together(inner_size, kept_inner, inner->kept + place, single);
            }
        }
    }
    return bad;
}

/* So many numbers of LANES cells, in whole lines of the memory. */
static lanes *many_lanes(int count)
{
    size_t size = sizeof(lanes) * (count + 64 / sizeof(lanes) + 1);
    return aligned_alloc(64, size / 64 * 64);
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
