/* One operation of a program: where it puts its value, and what it is of. */
typedef struct {
    int op, to, a, b, c, d;
} Instruction;

/* A mark of places among what is kept of a cell; others are among registers. */
enum { KEPT = 1 << 30 };

/* Values of the functions of an element at the points of a rule, for each entity: those that are not
 * zero, and all of them. */
typedef struct {
    int nodes;
    const int *begin, *node;   /* (entities points + 1,), (values,) */
    const double *value;       /* (values,) */
    const double *dense;       /* (entities, points, nodes) */
} Table;

/* Values of functions with the same table, from coefficients or from coordinates. */
typedef struct {
    int table, coordinates, stride, count;
    const int *first, *to;     /* (count,) */
} Loads;

/* What values are multiplied by: the functions of a table (-1: nothing), from a row or column on. */
typedef struct {
    int of, table, first, stride;
} Row;

typedef struct {
    int of, row, column;
} Pair;

/* Rows of one component with all columns beside them: nodes rows, of each of `rows` tables. */
typedef struct {
    int end;                   /* operations that come before it */
    int right;                 /* place of its products */
    int first, stride, nodes, rows, columns, width;
    const int *table;          /* (rows,) */
    const int *column, *last;  /* table of each column, and the end of those of its component, (columns,) */
    int blocks;                /* columns of one component stand together; 0: all columns of a vector */
    const int *block;          /* how many they are, (blocks,) */
    const int *of;             /* registers, -1 for none, (rows, columns) */
    const int *place;          /* columns of the matrix, (width,) */
} Dense;

/* Operations at points, with what they are of. */
typedef struct {
    int numbers, constants;
    double *uniform;           /* numbers, constants, those of the entity, and what follows from them */
    const int *constant;       /* (constants,) */
    int uniform_ops, ops;
    const Instruction *uniform_code, *code;
    const int *terms;          /* factors of the terms of sums */
    int weight;                /* register of the weights; -1: none */
    int loads;
    const Loads *load;
} Stage;

/* An integrand at the points of one rule. */
typedef struct {
    int points, chunk, entity_size;
    const double *entity;      /* (entities, entity_size) */
    const double *weights;
    const Table *tables;
    Stage steady, always;      /* what is kept of cells, and what is found at each call */
    int kept, place;           /* how many values of each point, and where they are of a cell */
    const int *keep;           /* their registers, (kept,) */
    int first_ops;             /* those of the latter stage come before all products */
    int rows, pairs, denses;
    const Row *row, *column;
    const Pair *pair;
    const Dense *dense;
} Rule;

/* Numbers in a row that what is kept follows from. */
typedef struct {
    int first, count;
} Range;

/* All integrands of one form over one kind of entity. Room is counted in numbers. */
typedef struct {
    int rank, columns, rules;
    const Rule *rule;
    int registers, products, factors;
    int reads;                 /* coefficients that it reads of a cell's, if not all */
    const int *read;           /* their places, (reads,) */
    /* what is kept of a cell: a stamp, coefficients and coordinates that it follows from, and values */
    int kept, ranges, coordinates, constants;
    const Range *range;        /* of coefficients */
    const int *constant;       /* (constants,) */
    double *seen;              /* their values, and the stamp of what follows from them, (constants + 1,) */
} Program;
