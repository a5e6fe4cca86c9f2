/* The passes of a solution over the cells of one mesh: from a right-hand side to that of the
 * reduced system, and from its solution back. They read what is kept of each cell, which is most
 * of their time, and stand twice in the program: with `NUMBER` double, and with float where factors
 * are of single precision, too; `OF` makes the names. All sums are of double precision. */

/* y += A x, of shape (m, n); short rows, for which a library call costs more than it saves */
static void OF(accumulate)(int m, int n, const NUMBER *A, const double *x, double *y)
{
    for (int i = 0; i < m; ++i) {
        double sum = 0.0;
        for (int j = 0; j < n; ++j)
            sum += A[(size_t)i * n + j] * x[j];
        y[i] += sum;
    }
}

/* y -= A^T x, of shape (m, n): row by row, which needs no sums across vectors */
static void OF(subtract)(int m, int n, const NUMBER *A, const double *x, double *y)
{
    for (int i = 0; i < m; ++i)
        for (int j = 0; j < n; ++j)
            y[j] -= A[(size_t)i * n + j] * x[i];
}

/* Right-hand side without element-wise unknowns: to the local vector `b`, which holds those of
 * the element-wise ones, add what they do to the others. */
void OF(reduce)(const Part *part, const double *b, double *change)
{
    const Cells *g = part->cells;
    int n = g->size, P = g->shared;
    double *r = malloc(sizeof(double) * n);
    for (int cell = 0; cell < g->cells; ++cell) {
        const int *dofs = g->dofs + (size_t)cell * n;
        const NUMBER *kept = part->OF(kept) + (size_t)cell * g->kept_size;
        for (int i = 0; i < n; ++i)
            r[i] = i < P ? 0.0 : b[dofs[i]];
        for (int s = 0; s < g->chunks; ++s) {
            int E = g->chunk_start[s], e = g->chunk_width[s];
            double *t = part->eliminated + (size_t)cell * (n - P) + (E - P);
            memset(t, 0, sizeof(double) * e);
            OF(accumulate)(e, e, kept + g->inverse_place[s], r + E, t);
            for (int x = g->left_runs[s]; x < g->left_runs[s + 1]; ++x)
                OF(subtract)(e, g->left_width[x], kept + g->left_place[x], t, r + g->left_start[x]);
        }
        for (int i = 0; i < P; ++i)
            change[dofs[i]] += r[i];
    }
    free(r);
}

/* The rest of a solution: element-wise unknowns into the local vector `x`, which holds the others,
 * and the rows of the multipliers times `x` added to `rows`. */
void OF(expand)(const Part *part, double *x, double *rows)
{
    const Cells *g = part->cells;
    int n = g->size, P = g->shared;
    double *v = malloc(sizeof(double) * (2 * n + g->multipliers + 1));
    double *sums = v + n, *out = sums + n;
    for (int cell = 0; cell < g->cells; ++cell) {
        const int *dofs = g->dofs + (size_t)cell * n;
        const NUMBER *kept = part->OF(kept) + (size_t)cell * g->kept_size;
        const double *eliminated = part->eliminated + (size_t)cell * (n - P);
        for (int i = 0; i < P; ++i)
            v[i] = x[dofs[i]];
        for (int s = g->chunks - 1; s >= 0; --s) {
            int E = g->chunk_start[s], e = g->chunk_width[s];
            memset(sums, 0, sizeof(double) * e);
            for (int y = g->right_runs[s]; y < g->right_runs[s + 1]; ++y)
                OF(accumulate)(e, g->right_width[y], kept + g->right_place[y],
                               v + g->right_start[y], sums);
            for (int i = 0; i < e; ++i)
                v[E + i] = eliminated[E - P + i] - sums[i];
        }
        for (int i = P; i < n; ++i)
            x[dofs[i]] = v[i];
        if (g->multipliers == 0)
            continue;
        memset(out, 0, sizeof(double) * g->multipliers);
        OF(accumulate)(g->multipliers, P, kept + g->multiplier_place, v, out);
        const int *at = part->projection->multiplier_rows + (size_t)cell * g->multipliers;
        for (int i = 0; i < g->multipliers; ++i)
            if (at[i] >= 0)
                rows[at[i]] += out[i];
    }
    free(v);
}

/* Reduced right-hand side without what no other cell shares: in `r`, what this rank sees of it,
 * theirs become K_II^-1 r_I; `change` gets what that does to the others. */
void OF(reduce_inner)(const Part *part, double *r, double *change)
{
    const Projection *p = part->projection;
    for (int cell = 0; cell < part->cells->cells; ++cell) {
        int q = p->inner_size[cell], rows = p->outer_rows[cell], columns = p->outer_columns[cell];
        if (q == 0)
            continue;
        const int *at = p->row_numbers + (size_t)cell * p->rows;
        const NUMBER *inverse = part->OF(inner_kept) + p->inner_place[cell];
        const NUMBER *left = inverse + q * q + q * columns;
        double t[256] = {0.0}, b[256];
        for (int i = 0; i < q; ++i)
            b[i] = r[at[rows + i]];
        OF(accumulate)(q, q, inverse, b, t);
        for (int i = 0; i < q; ++i)
            r[at[rows + i]] = t[i];
        for (int i = 0; i < rows; ++i) {
            double sum = 0.0;
            for (int j = 0; j < q; ++j)
                sum += left[i * q + j] * t[j];
            change[at[i]] -= sum;
        }
    }
}

/* Their values, into the reduced solution `x` that this rank sees, from `r` of reduce_inner. */
void OF(expand_inner)(const Part *part, const double *r, double *x)
{
    const Projection *p = part->projection;
    for (int cell = 0; cell < part->cells->cells; ++cell) {
        int q = p->inner_size[cell], rows = p->outer_rows[cell], columns = p->outer_columns[cell];
        if (q == 0)
            continue;
        const int *from = p->row_numbers + (size_t)cell * p->rows;
        const int *at = p->column_numbers + (size_t)cell * p->columns;
        const NUMBER *right = part->OF(inner_kept) + p->inner_place[cell] + q * q;
        for (int i = 0; i < q; ++i) {
            double sum = r[from[rows + i]];
            for (int j = 0; j < columns; ++j)
                sum -= right[i * columns + j] * x[at[j]];
            x[at[columns + i]] = sum;
        }
    }
}
