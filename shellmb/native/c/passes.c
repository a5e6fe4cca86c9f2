/* The passes of a solution over the cells of one mesh: from a right-hand side to that of the
 * reduced system, and from its solution back. Numbers of LANES cells stand side by side, in what is
 * kept of them and in all that is computed. */

/* y += sign A x, of shape (m, n); four sums at a time, each by its name, or gcc would not keep them
 * in registers: of one alone each product would wait for the one before */
static void product(int m, int n, const lanes *A, const lanes *x, double sign, lanes *y)
{
    int i = 0;
    for (; i + 4 <= m; i += 4) {
        const lanes *a = A + (size_t)i * n, *b = a + n, *c = b + n, *d = c + n;
        lanes p = {0.0}, q = {0.0}, r = {0.0}, s = {0.0};
        for (int j = 0; j < n; ++j) {
            p += a[j] * x[j];
            q += b[j] * x[j];
            r += c[j] * x[j];
            s += d[j] * x[j];
        }
        y[i] += sign * p;
        y[i + 1] += sign * q;
        y[i + 2] += sign * r;
        y[i + 3] += sign * s;
    }
    for (; i < m; ++i) {
        const lanes *a = A + (size_t)i * n;
        lanes p = {0.0};
        for (int j = 0; j < n; ++j)
            p += a[j] * x[j];
        y[i] += sign * p;
    }
}

/* Right-hand side without element-wise unknowns: to the local vector `b`, which holds those of
 * the element-wise ones, add what they do to the others. */
void reduce(const Part *part, const double *b, double *change)
{
    const Cells *g = part->cells;
    int n = g->size, P = g->shared;
    if (n == P)
        return;
    lanes *r = many_lanes(n), *t = (lanes *)part->eliminated;
    const lanes *kept = (const lanes *)part->projection->kept;
    for (int cell = 0; cell < g->cells; cell += LANES, kept += g->kept_size, t += n - P) {
        const int *dofs = part->dofs + (size_t)cell * n;
        memset(r, 0, sizeof(lanes) * P);
        memset(t, 0, sizeof(lanes) * (n - P));
        gather(n - P, dofs + P * LANES, b, r + P);
        for (int s = 0; s < g->chunks; ++s) {
            int E = g->chunk_start[s], e = g->chunk_width[s];
            product(e, e, kept + g->inverse_place[s], r + E, 1.0, t + E - P);
            for (int x = g->left_runs[s]; x < g->left_runs[s + 1]; ++x)
                product(g->left_width[x], e, kept + g->left_place[x], t + E - P, -1.0,
                        r + g->left_start[x]);
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
 * and the rows of the multipliers times `x` added to `rows`. */
void expand(const Part *part, double *x, double *rows)
{
    const Cells *g = part->cells;
    int n = g->size, P = g->shared, count = part->projection->multiplier.rows;
    if (n == P) {
        expand_alone(part, x, rows);
        return;
    }
    lanes *v = many_lanes(n + count), *out = v + n;
    const lanes *t = (const lanes *)part->eliminated;
    const lanes *kept = (const lanes *)part->projection->kept;
    for (int cell = 0; cell < g->cells; cell += LANES, kept += g->kept_size, t += n - P) {
        const int *dofs = part->dofs + (size_t)cell * n;
        gather(P, dofs, x, v);
        memcpy(v + P, t, sizeof(lanes) * (n - P));
        for (int s = g->chunks - 1; s >= 0; --s)
            for (int y = g->right_runs[s]; y < g->right_runs[s + 1]; ++y)
                product(g->chunk_width[s], g->right_width[y], kept + g->right_place[y],
                        v + g->right_start[y], -1.0, v + g->chunk_start[s]);
        put(n - P, dofs + P * LANES, v + P, x);
        memset(out, 0, sizeof(lanes) * count);
        product(count, P, kept + g->multiplier_place, v, 1.0, out);
        add(count, part->multiplier_rows + (size_t)cell * count, out, rows);
    }
    free(v);
}

/* Reduced right-hand side without what no other cell shares: in `r`, what this rank sees of it,
 * theirs become K_II^-1 r_I; `change` gets what that does to the others. */
void reduce_inner(const Part *part, double *r, double *change)
{
    const Inner *inner = part->projection->inner;
    lanes *b = many_lanes(2 * inner->most + inner->most_rows), *t = b + inner->most;
    lanes *out = t + inner->most;
    for (int group = 0; group < inner->groups; ++group) {
        Widths w = widths_of(inner, group);
        const int *outer = inner->row_numbers + inner->row_place[group];
        const int *own = outer + w.rows * LANES;
        const lanes *inverse = (const lanes *)inner->kept + inner->place[group];
        memset(t, 0, sizeof(lanes) * w.own);
        memset(out, 0, sizeof(lanes) * w.rows);
        gather(w.own, own, r, b);
        product(w.own, w.own, inverse, b, 1.0, t);
        put(w.own, own, t, r);
        product(w.rows, w.own, inverse + w.own * (w.own + w.columns), t, -1.0, out);
        add(w.rows, outer, out, change);
    }
    free(b);
}

/* Their values, into the reduced solution `x` that this rank sees, from `r` of reduce_inner. */
void expand_inner(const Part *part, const double *r, double *x)
{
    const Inner *inner = part->projection->inner;
    lanes *v = many_lanes(inner->most + inner->most_columns), *seen = v + inner->most;
    for (int group = 0; group < inner->groups; ++group) {
        Widths w = widths_of(inner, group);
        const int *from = inner->row_numbers + inner->row_place[group] + w.rows * LANES;
        const int *outer = inner->column_numbers + inner->column_place[group];
        const lanes *inverse = (const lanes *)inner->kept + inner->place[group];
        gather(w.own, from, r, v);
        gather(w.columns, outer, x, seen);
        product(w.own, w.columns, inverse + w.own * w.own, seen, -1.0, v);
        put(w.own, outer + w.columns * LANES, v, x);
    }
    free(v);
}
