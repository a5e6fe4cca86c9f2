/* Updates of derivatives by two scenes beside a run, at unknowns `u + d` and `u - d`, in one
 * process. */

/* Residual of a side, at the unknowns of the run and so many times `d`. */
static const double *residual_at(const OneSide *side, const BothSides *both, const double *u, double sign)
{
    for (int i = 0; i < both->size; ++i)
        side->x[i] = u[i] + sign * both->d[i];
    evaluate_at(side->evaluation, side->x, side->b);
    return side->b;
}

/* An update by one solution, for `factor` times a difference of residuals as of `TwoSided.rest`; `d` loses
 * `distance` times the solution, if it is `taken`. Returns the size of that relative to `d`, negative if there
 * is no solution. */
double update_both(const BothSides *both, const Parts *p, int kind, int taken, const double *u,
                   double factor, double distance, const Solution *solution, Reduced *reduced,
                   uintptr_t factors, const Band *band, const double *given)
{
    const double *above = residual_at(both->above, both, u, 1.0);
    const double *below = kind == 1 || kind == 3 ? residual_at(both->below, both, u, -1.0) : NULL;
    for (int i = 0; i < both->size; ++i) {
        if (below)
            both->sum[i] = above[i] + below[i];
        both->rest[i] = factor * (kind == 3 ? both->sum[i] : 2.0 * above[i] - (kind ? both->sum[i] : 0.0));
    }
    if (solve_for(solution, reduced, factors, band, both->rest, NULL, given, both->change))
        return -1.0;
    for (int i = 0; i < both->size; ++i) {
        both->change[i] *= distance;
        both->d[i] -= taken ? both->change[i] : 0.0;
    }
    largest(p, 1, 0, both->change, p->table);
    largest(p, 1, 0, both->d, p->table + p->parts);
    relate(p);
    return p->found[3];
}
