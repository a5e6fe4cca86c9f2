/* Passes of a transposed solution: those of passes.c with rows and columns exchanged. */

/* y += sign A^T x, A of shape (m, n) */
static void product_transposed(int m, int n, const lanes *A, const lanes *x, double sign, lanes *y)
{
    for (int i = 0; i < m; ++i, A += n) {
        lanes s = sign * x[i];
        for (int j = 0; j < n; ++j)
            y[j] += A[j] * s;
    }
}

/* As `reduce`, of the transposed system. */
void reduce_transposed(const Part *part, const double *b, double *change)
{
    const Cells *g = part->cells;
    int n = g->size, P = g->shared;
    lanes *r = many_lanes(n), *t = (lanes *)part->eliminated;
    const lanes *kept = (const lanes *)part->projection->kept;
    for (int cell = 0; cell < g->cells; cell += LANES, kept += g->kept_size, t += n - P) {
        const int *dofs = part->dofs + (size_t)cell * n;
        memset(r, 0, sizeof(lanes) * P);
        gather(n - P, dofs + P * LANES, b, r + P);
        for (int s = 0; s < g->chunks; ++s) {
            int E = g->chunk_start[s], e = g->chunk_width[s];
            memcpy(t + E - P, r + E, sizeof(lanes) * e);
            for (int y = g->right_runs[s]; y < g->right_runs[s + 1]; ++y)
                product_transposed(e, g->right_width[y], kept + g->right_place[y], t + E - P, -1.0,
                                   r + g->right_start[y]);
        }
        add(P, dofs, r, change);
    }
    free(r);
}

/* As `expand`, of the transposed system, without multipliers. */
void expand_transposed(const Part *part, double *x)
{
    const Cells *g = part->cells;
    int n = g->size, P = g->shared;
    lanes *v = many_lanes(n), *t = (lanes *)part->eliminated;
    const lanes *kept = (const lanes *)part->projection->kept;
    for (int cell = 0; cell < g->cells; cell += LANES, kept += g->kept_size, t += n - P) {
        const int *dofs = part->dofs + (size_t)cell * n;
        gather(P, dofs, x, v);
        memset(v + P, 0, sizeof(lanes) * (n - P));
        for (int s = g->chunks - 1; s >= 0; --s) {
            int E = g->chunk_start[s], e = g->chunk_width[s];
            for (int y = g->left_runs[s]; y < g->left_runs[s + 1]; ++y)
                product_transposed(g->left_width[y], e, kept + g->left_place[y],
                                   v + g->left_start[y], -1.0, t + E - P);
            product_transposed(e, e, kept + g->inverse_place[s], t + E - P, 1.0, v + E);
        }
        put(n - P, dofs + P * LANES, v + P, x);
    }
    free(v);
}

/* As `reduce_inner`, of the transposed system; `r` stays as it is. */
void reduce_inner_transposed(const Part *part, const double *r, double *change)
{
    const Inner *inner = part->projection->inner;
    lanes *b = many_lanes(inner->most + inner->most_columns), *out = b + inner->most;
    for (int group = 0; group < inner->groups; ++group) {
        Widths w = widths_of(inner, group);
        const int *outer = inner->column_numbers + inner->column_place[group];
        const lanes *inverse = (const lanes *)inner->kept + inner->place[group];
        memset(out, 0, sizeof(lanes) * w.columns);
        gather(w.own, outer + w.columns * LANES, r, b);
        product_transposed(w.own, w.columns, inverse + w.own * w.own, b, -1.0, out);
        add(w.columns, outer, out, change);
    }
    free(b);
}

/* As `expand_inner`, of the transposed system, from `r` of reduce_inner_transposed. */
void expand_inner_transposed(const Part *part, const double *r, double *x)
{
    const Inner *inner = part->projection->inner;
    lanes *v = many_lanes(2 * inner->most + inner->most_rows), *found = v + inner->most;
    lanes *seen = found + inner->most;
    for (int group = 0; group < inner->groups; ++group) {
        Widths w = widths_of(inner, group);
        const int *own = inner->column_numbers + inner->column_place[group] + w.columns * LANES;
        const int *outer = inner->row_numbers + inner->row_place[group];
        const lanes *inverse = (const lanes *)inner->kept + inner->place[group];
        gather(w.own, own, r, v);
        gather(w.rows, outer, x, seen);
        product_transposed(w.rows, w.own, inverse + w.own * (w.own + w.columns), seen, -1.0, v);
        memset(found, 0, sizeof(lanes) * w.own);
        product_transposed(w.own, w.own, inverse, v, 1.0, found);
        put(w.own, outer + w.rows * LANES, found, x);
    }
    free(v);
}
