typedef void tabulate_tensor(double *, const double *, const double *, const double *, const int *,
                             const uint8_t *, void *);

/* One form over the cells of a mesh, or over some of their facets. */
typedef struct {
    void *function;            /* tabulate_tensor of FFCx */
    int lanes;                 /* cells that it takes at once */
    int adds;                  /* whether to what is there; if not, it is the first to come there */
    const double *constants;   /* packed */
    int rows, columns;         /* of the element tensor; one column of a linear form */
    const int *row_place;      /* place of each row among the unknowns of the cell, (rows,) */
    const int *column_place;   /* of each column; NULL for a linear form */
    int coefficients;
    const double **values;     /* their arrays */
    const int **dofs;          /* their local dofs cell by cell, or of `lanes` cells side by side */
    const int *sizes;          /* number of dofs in a cell */
    const int *entity_offsets; /* facets of each cell, (cells + 1,); NULL: the cell itself */
    const int *entities;       /* their local numbers */
    double *store;             /* what the function may keep of each group of cells, or of each facet */
    int64_t store_size;
} Kernel;

/* Pieces of a row or column of blocks that are not zero behind a chunk of unknowns. */
typedef struct {
    const int *first;          /* of each chunk, (chunks + 1,) */
    const int *start, *width, *place;
} Runs;

/* The cells of one mesh with the fields on it. Element-wise unknowns are eliminated chunk by chunk. */
typedef struct {
    int cells;
    int size;                  /* unknowns of a cell */
    int shared;                /* those that are not element-wise; they come first */
    const int *dofs;           /* place of each unknown in the local arrays, (cells, size) */
    const double *geometry;    /* coordinates of the cells' nodes */
    int geometry_size, coefficient_size;
    int lanes;                 /* cells that are taken at once */
    int covered;               /* whether kernels that do not add give a cell's whole matrix */
    const double *geometry_of_lanes; /* coordinates of so many cells side by side, from whole lines
                                      * of the memory on */
    int chunks;
    const int *chunk_start, *chunk_width;
    const int *block_place;    /* where the K_EE of a cell is, (chunks,) */
    int block_size;            /* what all of them take */
    const int *inverse_place;  /* where its K_EE^-1 is in what is kept, (chunks,) */
    Runs right, left;          /* K_EE^-1 K_Ey, and K_xE */
    int multiplier_place;      /* rows of the multipliers at the nodes */
    int kept_size;             /* what is kept of a cell */
} Cells;

/* What no other cell shares, the last of a cell's reduced unknowns, LANES cells side by side: of
 * each group K_II^-1, K_II^-1 K_Iy and K_xI, as large as its largest cell needs. */
typedef struct {
    int groups, most, most_rows, most_columns;
    const int *widths;         /* rows and columns of the others, and own ones, (groups, 3) */
    const int64_t *place, *row_place, *column_place;
    const int *row_numbers, *column_numbers; /* of the others, then own; -1 where there is none */
    double *kept;
} Inner;

/* Combinations of the shared unknowns of each cell: of each row its terms, one after the other, and
 * of each term which of the unknowns it has and where its coefficient is. */
typedef struct {
    int rows, most;            /* of a cell; terms of a cell at most */
    const int *begin;          /* first term of each row, (cells rows + 1,) */
    const int *from, *at;      /* (terms,) */
    const double *values;
} Terms;

/* What is reduced of a cell: rows and columns of its reduced matrix, and multipliers at its nodes. */
typedef struct {
    Terms left, right, multiplier;
    /* entries that are not always zero, as runs (from, to, length) that follow one another in a
     * cell's matrix and among all values, for each cell those that are the first there, then those to
     * be added */
    const int *runs, *run_offsets;           /* (runs, 3), (2 cells + 1,) */
    const int *inner_size, *outer_rows, *outer_columns; /* (cells,) */
    const Inner *inner;                      /* NULL: nothing */
    double *kept;                            /* of all cells, LANES side by side if they have
                                              * element-wise unknowns */
} Projection;

/* A Jacobian over the cells of one mesh: constants that its kernels take first, as of `copy_pieces`,
 * and arguments of `jacobian`. */
typedef struct {
    int pieces;
    double **from, **to;
    const int *sizes;
    const Cells *cells;
    const Kernel *kernels;
    int count;
    const Projection *projection;
    double *blocks, *values;
} Jacobian;

/* Directors of nodes in a step: `reference` + value at both ends, of which states are sums with weights
 * of start, velocity there, end, and velocity there. Over one that is quadratic in time there are
 * seven: the end, where rates are tangent and what these have of the end, the mean, where the second
 * force acts, a sixth of the chord, and the mean velocity. */
typedef struct {
    const int64_t *dofs;       /* (nodes, 3 directors) */
    const double *reference;   /* of the same shape */
    const double *values[4];   /* of all local dofs */
    const double *weights;     /* (states, 4) */
} PathNodes;

/* Rows for a table, of so many unknowns of each node in turn. */
typedef struct {
    int count, width, table_width, components;
    const int64_t *to, *from;  /* rows of the table, and of the values */
    const double *values;
    const double *divisors;    /* of each node's columns; NULL: one */
    double *table;
} RowsToPut;

/* What a solution with the reduced matrix needs of one mesh. */
typedef struct {
    const Cells *cells;
    const Projection *projection;
    const int *dofs, *multiplier_rows; /* of LANES cells side by side, -1 where there is none */
    double *eliminated;        /* K_EE^-1 b_E of all cells */
} Part;

/* A matrix with few entries in each row: of each its row, its column and where its value is. */
typedef struct {
    int count;
    const int *row, *column, *at;
} Entries;

/* Local dofs by the columns that are combined in them. */
typedef struct {
    int rows, columns;
    const double *values;
    Entries local;             /* of all local dofs */
    Entries own;               /* of the unknowns that this rank owns, each once */
} Rows;

/* All unknowns of one process and the reduced ones. */
typedef struct {
    int parts, owned, local, reduced, outer, multipliers;
    const Part *part;
    const int64_t *wanted;     /* unknown of each local dof */
    const int64_t *own;        /* a local dof of each unknown */
    const int64_t *outer_numbers; /* reduced unknowns that are in the matrix */
    Rows left, right, force, multiplier;
    double *b, *change;        /* (local,) */
    double *reaction;          /* (owned,) */
    double *forces, *rows;     /* (multipliers,) */
    double *r, *seen;          /* (reduced,) */
    double *rest;              /* (reduced,) */
} Solution;

/* A matrix whose entries are in a band once its unknowns are reordered, and its factors. */
typedef struct {
    int size, below, above, entries;
    int width, height;         /* of a row and a column of factors, with zeros up to whole vectors */
    const int *row, *column;   /* of each entry */
    const int *place;          /* where it is in the band */
    const int *order;          /* new place of each unknown */
    double *row_scale, *column_scale, *work;
    double *factors;           /* rows of the upper one from `below` before the diagonal on, (size,
                                * width) */
    double *lower;             /* columns of the lower one, (size, height) */
    int *pivots, *counts;      /* row that came to each place, and entries behind its diagonal */
} Band;

/* Vectors of the reduced system: PETSc's, and their numbers. */
typedef struct {
    void *right, *unknown;
    double *rhs, *solution;
    double seconds;            /* that the last solution took */
} Reduced;

/* Linear forms over the cells of some meshes. */
typedef struct {
    int meshes;
    const Cells **cells;
    const Kernel **kernels;
    const int *counts;         /* kernels of each mesh */
} Residuals;

/* What one process evaluates at once: the fields take the values of unknowns, others follow them, and
 * residuals are added up. */
typedef struct {
    int fields, local, owned;
    const int64_t *ends;       /* of each field in what they are all together, (fields,) */
    double **arrays;
    const int64_t *wanted;     /* unknown of each local dof */
    int followers;
    const int *sizes, *terms;  /* as of `follow` */
    double **from, **to;
    const double *weights;
    const Residuals *meshes;
    double *sums;              /* (local,) */
    int held;
    const int64_t *fixed;      /* unknowns that have given values */
    const double *values;      /* as of `hold` */
    double *reactions;
} Evaluation;

/* Directors that keep their constraints: `reference` + unknown. */
typedef struct {
    int nodes, directors;
    const int64_t *rows, *rates; /* their unknowns, (nodes, 3 directors); of rates, or NULL */
    const double *reference;
} Turning;

/* A scene beside a run, its unknowns and their residual. */
typedef struct {
    const Evaluation *evaluation;
    double *x, *b;
} OneSide;

/* Parts of unknowns, for changes and sizes of each, (2, parts), and how they are compared, as of
 * `ComparedParts`. */
typedef struct {
    int parts;
    const int64_t *ends, *entries;
    const double *scales, *bounds, *weights, *moves;
    double *table, *found;
    double least;
} Parts;

/* Scenes at both sides of a run, and half the difference of their unknowns. */
typedef struct {
    int size;
    const OneSide *above, *below;
    double *d, *sum;           /* of the residuals of both sides, as they were evaluated last */
    double *rest, *change;     /* right-hand side of an update, and what it solves for */
} BothSides;
