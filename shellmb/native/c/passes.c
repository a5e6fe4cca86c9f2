/* The passes of a solution over the cells of one mesh: from a right-hand side to that of the
 * reduced system, and from its solution back. Of the transposed system, they are the same with rows
 * and columns exchanged. Numbers of LANES cells stand side by side, in what is kept of them and in all
 * that is computed. */

/* y += sign A x, of so few rows of n numbers. */
static ALWAYS void few_products(int some, int n, const lanes *A, const lanes *x, double sign, lanes *y)
{
    lanes sums[MANY];
    SOME(k) sums[k] = (lanes){0.0};
    for (int j = 0; j < n; ++j)
        SOME(k) sums[k] += A[(size_t)k * n + j] * x[j];
    SOME(k) y[k] += sign * sums[k];
}

/* y += sign A x, of shape (m, n); four sums at a time: of one alone each product would wait for the one
 * before */
static void product(int m, int n, const lanes *A, const lanes *x, double sign, lanes *y)
{
    int i = 0;
    for (; i + 4 <= m; i += 4)
        few_products(4, n, A + (size_t)i * n, x, sign, y + i);
    for (; i < m; ++i)
        few_products(1, n, A + (size_t)i * n, x, sign, y + i);
}

/* The same of A^T, A of shape (n, m), if it is `transposed`. */
static void multiply_by(int transposed, int m, int n, const lanes *A, const lanes *x, double sign,
                        lanes *y)
{
    if (!transposed) {
        product(m, n, A, x, sign, y);
        return;
    }
    for (int j = 0; j < n; ++j, A += m) {
        lanes s = sign * x[j];
        for (int i = 0; i < m; ++i)
            y[i] += A[i] * s;
    }
}

/* Right-hand side without element-wise unknowns: to the local vector `b`, which holds those of
 * the element-wise ones, add what they do to the others. */
void reduce(const Part *part, int transposed, const double *b, double *change)
{
    const Cells *g = part->cells;
    int n = g->size, P = g->shared;
    if (n == P)
        return;
    const Runs *runs = transposed ? &g->right : &g->left;
    lanes *r = many_lanes(n), *t = (lanes *)part->eliminated;
    const lanes *kept = (const lanes *)part->projection->kept;
    for (int cell = 0; cell < g->cells; cell += LANES, kept += g->kept_size, t += n - P) {
        const int *dofs = part->dofs + (size_t)cell * n;
        memset(r, 0, sizeof(lanes) * P);
        memset(t, 0, sizeof(lanes) * (n - P));
        gather(n - P, dofs + P * LANES, b, r + P);
        for (int s = 0; s < g->chunks; ++s) {
            int E = g->chunk_start[s], e = g->chunk_width[s];
            if (transposed)
                memcpy(t + E - P, r + E, sizeof(lanes) * e);
            else
                product(e, e, kept + g->inverse_place[s], r + E, 1.0, t + E - P);
            for (int x = runs->first[s]; x < runs->first[s + 1]; ++x)
                multiply_by(transposed, runs->width[x], e, kept + runs->place[x], t + E - P, -1.0,
                           r + runs->start[x]);
        }
        add(P, dofs, r, change);
    }
    free(r);
}

/* Rows of A times x. */
static ALWAYS void rows_of_one(int some, int n, const double *A, const double *x, double *out)
{
    double sums[MANY];
    SOME(k) sums[k] = 0.0;
    for (int j = 0; j < n; ++j)
        SOME(k) sums[k] += A[(size_t)k * n + j] * x[j];
    SOME(k) out[k] = sums[k];
}

/* The rows of the multipliers times `x` added to `rows`, of cells without element-wise unknowns, as
 * those of joints, of which a mechanism may have one of a kind: they stand one after the other. */
static void expand_alone(const Part *part, const double *x, double *rows)
{
    const Cells *g = part->cells;
    int P = g->shared, count = part->projection->multiplier.rows;
    double *v = (double *)many_lanes((P + count) / LANES + 1), *out = v + P;
    const double *A = part->projection->kept;
    for (int cell = 0; cell < g->cells; ++cell, A += (size_t)count * P) {
        const int *to = part->multiplier_rows + cell / LANES * LANES * count + cell % LANES;
        for (int j = 0; j < P; ++j)
            v[j] = x[g->dofs[(size_t)cell * P + j]];
        for (int i = 0; i < count; i += MANY) {
#define ALONE(some) rows_of_one(some, P, A + (size_t)i * P, v, out + i)
            switch (count - i < MANY ? count - i : MANY) {
                CASES(ALONE)
            }
        }
        for (int i = 0; i < count; ++i)
            if (to[i * LANES] >= 0)
                rows[to[i * LANES]] += out[i];
    }
    free(v);
}

/* The rest of a solution: element-wise unknowns into the local vector `x`, which holds the others,
 * and the rows of the multipliers times `x` added to `rows`, none of a transposed system. */
void expand(const Part *part, int transposed, double *x, double *rows)
{
    const Cells *g = part->cells;
    int n = g->size, P = g->shared, count = transposed ? 0 : part->projection->multiplier.rows;
    if (n == P) {
        if (count)
            expand_alone(part, x, rows);
        return;
    }
    const Runs *runs = transposed ? &g->left : &g->right;
    lanes *v = many_lanes(2 * n + count), *out = v + n;
    const lanes *t = (const lanes *)part->eliminated;
    const lanes *kept = (const lanes *)part->projection->kept;
    for (int cell = 0; cell < g->cells; cell += LANES, kept += g->kept_size, t += n - P) {
        const int *dofs = part->dofs + (size_t)cell * n;
        gather(P, dofs, x, v);
        memcpy(v + P, t, sizeof(lanes) * (n - P));
        for (int s = g->chunks - 1; s >= 0; --s) {
            int E = g->chunk_start[s], e = g->chunk_width[s];
            for (int y = runs->first[s]; y < runs->first[s + 1]; ++y)
                multiply_by(transposed, e, runs->width[y], kept + runs->place[y],
                           v + runs->start[y], -1.0, v + E);
            if (transposed) {
                memcpy(out, v + E, sizeof(lanes) * e);
                memset(v + E, 0, sizeof(lanes) * e);
                multiply_by(1, e, e, kept + g->inverse_place[s], out, 1.0, v + E);
            }
        }
        put(n - P, dofs + P * LANES, v + P, x);
        memset(out, 0, sizeof(lanes) * count);
        product(count, P, kept + g->multiplier_place, v, 1.0, out);
        add(count, part->multiplier_rows + (size_t)cell * count, out, rows);
    }
    free(v);
}

/* What no other cell shares in a group of cells: numbers of the others' equations and unknowns, and
 * own ones behind these. */
typedef struct {
    Widths of;
    const int *equations, *unknowns;
    const lanes *inverse, *right, *left;
} Group;

static Group group_of(const Inner *inner, int group, int transposed)
{
    Widths w = widths_of(inner, group);
    const int *rows = inner->row_numbers + inner->row_place[group];
    const int *columns = inner->column_numbers + inner->column_place[group];
    const lanes *inverse = (const lanes *)inner->kept + inner->place[group];
    const lanes *right = inverse + w.own * w.own, *left = right + w.own * w.columns;
    if (transposed)
        return (Group){{w.columns, w.rows, w.own}, columns, rows, inverse, left, right};
    return (Group){w, rows, columns, inverse, right, left};
}

/* Reduced right-hand side without what no other cell shares: in `r`, what this rank sees of it,
 * theirs become K_II^-1 r_I, and stay as they are in a transposed system; `change` gets what that does
 * to the others. */
void reduce_inner(const Part *part, int transposed, double *r, double *change)
{
    const Inner *inner = part->projection->inner;
    lanes *b = many_lanes(2 * inner->most + inner->most_rows + inner->most_columns);
    lanes *t = b + inner->most, *out = t + inner->most;
    for (int k = 0; k < inner->groups; ++k) {
        Group g = group_of(inner, k, transposed);
        const int *own = g.equations + g.of.rows * LANES;
        gather(g.of.own, own, r, b);
        if (!transposed) {
            memset(t, 0, sizeof(lanes) * g.of.own);
            product(g.of.own, g.of.own, g.inverse, b, 1.0, t);
            put(g.of.own, own, t, r);
        }
        memset(out, 0, sizeof(lanes) * g.of.rows);
        multiply_by(transposed, g.of.rows, g.of.own, g.left, transposed ? b : t, -1.0, out);
        add(g.of.rows, g.equations, out, change);
    }
    free(b);
}

/* Their values, into the reduced solution `x` that this rank sees, from `r` of reduce_inner. */
void expand_inner(const Part *part, int transposed, const double *r, double *x)
{
    const Inner *inner = part->projection->inner;
    lanes *v = many_lanes(2 * inner->most + inner->most_rows + inner->most_columns);
    lanes *found = v + inner->most, *seen = found + inner->most;
    for (int k = 0; k < inner->groups; ++k) {
        Group g = group_of(inner, k, transposed);
        gather(g.of.own, g.equations + g.of.rows * LANES, r, v);
        gather(g.of.columns, g.unknowns, x, seen);
        multiply_by(transposed, g.of.own, g.of.columns, g.right, seen, -1.0, v);
        if (transposed) {
            memset(found, 0, sizeof(lanes) * g.of.own);
            multiply_by(1, g.of.own, g.of.own, g.inverse, v, 1.0, found);
        }
        put(g.of.own, g.unknowns + g.of.columns * LANES, transposed ? found : v, x);
    }
    free(v);
}
