/* FFCx's kernels over the cells of a mesh: matrices, residuals and integrals of cells.
 *
 * Some kernels are of several cells at once (shellmb/native/compiling/language.py): their numbers are those
 * of as many cells side by side.
 */

/* What kernels work with: values of coefficients, what they give, and room for more. */
typedef struct {
    double *w, *A, *more;
} Work;

/* Room that stays, for one function at a time: what the system is asked for anew it gives page by
 * page, which takes longer than the elimination of a few cells. */
static Work work_of(const Cells *g, size_t entries, size_t more)
{
    static _Thread_local double *room;
    static _Thread_local size_t size;
    /* vectors of a processor begin at whole ones of theirs */
    size_t line = 64 / sizeof(double), lanes = g->lanes;
    size_t w = (g->coefficient_size * lanes + line) / line * line;
    size_t A = (entries * lanes + line) / line * line;
    size_t all = w + A + (more + line) / line * line;
    if (all > size) {
        free(room);
        room = aligned_alloc(64, sizeof(double) * all);
        size = all;
    }
    return (Work){room, room + w, room + w + A};
}

/* Element tensors of a kernel over the cells that it takes at once, `count` of them, each put or
 * added at its own `out` (row-major, `stride` columns), which is `apart` from that before. */
static void tabulate_group(const Kernel *k, const Cells *g, int cell, int count, Work work,
                           double *out, size_t apart, int stride)
{
    int n = k->lanes, first = 0, last = 1;
    if (k->entity_offsets) {
        first = k->entity_offsets[cell];
        last = k->entity_offsets[cell + 1];
        if (first == last)
            return;
    }
    double *to = work.w;
    for (int c = 0; c < k->coefficients; ++c) {
        const double *values = k->values[c];
        const int *dofs = k->dofs[c] + (size_t)cell * k->sizes[c];
        for (int i = 0; i < k->sizes[c] * n; ++i)
            *to++ = values[dofs[i]];
    }
    memset(work.A, 0, sizeof(double) * n * k->rows * k->columns);
    tabulate_tensor *f = (tabulate_tensor *)k->function;
    const double *x = n == 1 ? g->geometry : g->geometry_of_lanes;
    x += (size_t)cell * g->geometry_size;
    for (int e = first; e < last; ++e) {
        const int *entity = k->entity_offsets ? k->entities + e : NULL;
        double *kept = k->store ? k->store + k->store_size * (entity ? e : cell / n) : NULL;
        f(work.A, work.w, k->constants, x, entity, NULL, &kept);
    }
    /* what a linear form gives is taken for a row */
    const int zero = 0, bilinear = k->column_place != NULL;
    const int m = bilinear ? k->rows : 1, width = bilinear ? k->columns : k->rows;
    const int *rows = bilinear ? k->row_place : &zero;
    const int *columns = bilinear ? k->column_place : k->row_place;
    if (n > 1) {
        take_apart(m, width, (lanes *)work.A, rows, columns, count, k->adds, out, apart, stride);
        return;
    }
    const int beside = in_line(width, columns);
    for (int i = 0; i < m; ++i) {
        const double *restrict from = work.A + i * width;
        double *restrict to = out + (size_t)rows[i] * stride;
        /* apart, or the compiler would take no vectors */
        if (beside)
            for (int j = 0; j < width; ++j)
                to[columns[0] + j] += from[j];
        else
            for (int j = 0; j < width; ++j)
                to[columns[j]] += from[j];
    }
}

/* The same over `count` cells, the first of them a multiple of `g->lanes`. */
static void tabulate(const Kernel *k, const Cells *g, int cell, int count, Work work, double *out,
                     size_t apart, int stride)
{
    for (int l = 0; l < count; l += k->lanes) {
        int left = count - l;
        tabulate_group(k, g, cell + l, left < k->lanes ? left : k->lanes, work, out + l * apart,
                       apart, stride);
    }
}

/* Matrices of some cells as they are, shape (some, size, stride). */
static void matrices(const Cells *g, const Kernel *kernels, int count, int cell, int some,
                     Work work, double *K, int stride)
{
    size_t square = (size_t)g->size * stride;
    if (!g->covered)
        memset(K, 0, sizeof(double) * square * some);
    for (int k = 0; k < count; ++k)
        tabulate(kernels + k, g, cell, some, work, K, square, stride);
}

/* How many cells are taken at once from one on. */
static int taken(const Cells *g, int cell)
{
    return g->cells - cell < g->lanes ? g->cells - cell : g->lanes;
}

/* Matrices of some cells, of whole groups of `g->lanes` from `first` on, (last - first, size, size). */
void cell_matrices(const Cells *g, const Kernel *kernels, int count, int first, int last, double *K)
{
    size_t square = (size_t)g->size * g->size;
    Work work = work_of(g, square, 0);
    for (int cell = first; cell < last; cell += g->lanes, K += g->lanes * square)
        matrices(g, kernels, count, cell, taken(g, cell), work, K, g->size);
}

/* Vectors of all cells, residuals or sums of integrals, added to `b` at the places `g->dofs`. */
void residual(const Cells *g, const Kernel *kernels, int count, double *b)
{
    Work work = work_of(g, g->size, (size_t)g->size * g->lanes);
    double *r = work.more;
    for (int cell = 0; cell < g->cells; cell += g->lanes) {
        int some = taken(g, cell);
        memset(r, 0, sizeof(double) * g->size * some);
        for (int k = 0; k < count; ++k)
            tabulate(kernels + k, g, cell, some, work, r, g->size, 1);
        const int *dofs = g->dofs + (size_t)cell * g->size;
        for (int i = 0; i < g->size * some; ++i)
            b[dofs[i]] += r[i];
    }
}
