/* Updates of derivatives by two scenes beside a run, at unknowns `u + d` and `u - d`, in one
 * process. */

/* Unknowns of a side: those of the run and so many times `d`. */
static void put_side(const OneSide *side, const BothSides *both, const double *u, double sign)
{
    for (int i = 0; i < both->size; ++i)
        side->x[i] = u[i] + sign * both->d[i];
}

/* Directors of a side that keep their constraints, and given values. */
static void keep(const OneSide *side)
{
    const Evaluation *e = side->evaluation;
    for (int k = 0; k < side->sets; ++k)
        normalise_nodes(side->set[k], side->x);
    for (int i = 0; i < e->held; ++i)
        side->x[e->fixed[i]] = e->values[e->fixed[i]];
}

/* Differences `d` that keep the constraints of both sides to first order. */
void keep_both(const BothSides *both, const double *u)
{
    put_side(both->above, both, u, 1.0);
    put_side(both->below, both, u, -1.0);
    keep(both->above);
    keep(both->below);
    for (int i = 0; i < both->size; ++i)
        both->d[i] = 0.5 * (both->above->x[i] - both->below->x[i]);
}

static void evaluate_side(const OneSide *side, const BothSides *both, const double *u, double sign)
{
    put_side(side, both, u, sign);
    evaluate_at(side->evaluation, side->x, side->b);
}

/* Right-hand side of an update: `factor` times a difference of residuals. Of `kind` 0 it is twice
 * the residual above: that of the run is zero. Of kind 1 it is the residual above less that below,
 * which is kept for kind 2: this, and twice the change of the residual above since. Of kind 3 it is
 * the sum of both residuals. */
void rest_of(const BothSides *both, int kind, const double *u, double factor, double *rest)
{
    const double *above = both->above->b, *below = both->below->b;
    evaluate_side(both->above, both, u, 1.0);
    if (kind == 1 || kind == 3)
        evaluate_side(both->below, both, u, -1.0);
    for (int i = 0; i < both->size; ++i) {
        double found = 2.0 * above[i];
        if (kind == 1) {
            both->one[i] = above[i];
            both->central[i] = found = above[i] - below[i];
        } else if (kind == 2)
            found = both->central[i] + 2.0 * (above[i] - both->one[i]);
        else if (kind == 3)
            found = above[i] + below[i];
        rest[i] = factor * found;
    }
}

/* Take so many times a change from `d`, or none if it is not `taken`; its size relative to `d`. */
double move_both(const BothSides *both, const Parts *p, int taken, double factor,
                 const double *change)
{
    for (int i = 0; i < both->size; ++i) {
        both->change[i] = factor * change[i];
        if (taken)
            both->d[i] -= both->change[i];
    }
    largest(p, 1, 0, both->change, p->table);
    largest(p, 1, 0, both->d, p->table + p->parts);
    relate(p);
    return p->found[3];
}

/* An update by one solution, as of `rest_of`, `solve` and `move_both`; negative if it failed. */
double update_both(const BothSides *both, const Parts *p, int kind, int taken, const double *u,
                   double factor, double distance, const Solution *solution, Reduced *reduced,
                   uintptr_t factors, const Band *band, const double *given)
{
    rest_of(both, kind, u, factor, both->rest);
    if (solve_for(solution, reduced, factors, band, both->rest, NULL, given, both->solution))
        return -1.0;
    return move_both(both, p, taken, distance, both->solution);
}

/* Give the fields of both sides their unknowns. */
void hold_both(const BothSides *both, const double *u)
{
    for (int k = 0; k < 2; ++k) {
        const OneSide *side = k ? both->below : both->above;
        put_side(side, both, u, k ? -1.0 : 1.0);
        give(side->evaluation, side->x);
    }
}
