/* One unit of the search's work: screen, improve or verify designs of one combination.
 *
 * A task and its answer are plain bytes. The answer depends on the problem and the task alone, so
 * it may be computed by any thread, process or machine of the same build, in any order.
 */
#ifndef LOSTMOTION_OPTIMIZER_TASK_H
#define LOSTMOTION_OPTIMIZER_TASK_H

#include <stdint.h>

#include "problem.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Value and violation of a point that the model refuses. */
#define LM_REFUSED 1e3

/* Largest number of designs that a task reports besides its best one. */
#define LM_SOLUTION_MAX 96

/* Population of an evolving task. */
#define LM_PARENT_MAX 40

typedef struct lm_solution {
  int combination;
  int verified; /* 1: rounded to whole grades and checked on the fine scan */
  double violation;
  double unit[LM_FREE_MAX];
  double objective[LM_OBJECTIVE_MAX];
} lm_solution;

/* Objective of a task: the largest over the objectives of
 *   weight (f - origin) / scale,
 * with each objective at most `most`. A weight of 0 leaves an objective out. */
typedef struct lm_scalarisation {
  double weight[LM_OBJECTIVE_MAX];
  double origin[LM_OBJECTIVE_MAX];
  double scale[LM_OBJECTIVE_MAX];
  double most[LM_OBJECTIVE_MAX]; /* HUGE_VAL: no bound */
} lm_scalarisation;

typedef enum lm_task_kind {
  LM_TASK_SCREEN = 0, /* the best of a few scattered points, gaps closed */
  LM_TASK_SLSQP,      /* gradients, epigraph form */
  LM_TASK_COBYLA,     /* no gradients, largest limits of each group */
  LM_TASK_ISRES,      /* population of 60 */
  LM_TASK_EVOLVE,     /* a population over all combinations */
  LM_TASK_EVALUATE,   /* only the start; if it violates a limit, also with its gap closed */
  LM_TASK_REPAIR,     /* the point with the least relaxation; improved if none is required */
  LM_TASK_ROUND,      /* the start with its grades to the nearest, all down and all up */
  LM_TASK_CONFIRM,    /* the start, its gap opened, checked as the certificate does */
  LM_TASK_VERIFY      /* whole grades, no violation between the angles of the scan */
} lm_task_kind;

typedef struct lm_task {
  int id; /* place in the search's order, from 0 */
  int kind;
  int combination;
  int budget; /* plain evaluations */
  uint64_t seed;
  lm_scalarisation scalar;
  double unit[LM_FREE_MAX]; /* start */
  int parent_count;
  lm_solution parent[LM_PARENT_MAX]; /* start of LM_TASK_EVOLVE */
} lm_task;

typedef struct lm_answer {
  int id;
  int combination;
  int computed;       /* 1: unit and what follows hold a design */
  int plain;          /* evaluations without */
  int slopes;         /* and with derivatives */
  int tolerance_only; /* at other tolerances of evaluated designs */
  int refused;        /* of the first two, that the model refused or without a finite result */
  int feasible;       /* of the first two, that violated no limit */
  int solution_count;
  int member_count;
  double value; /* of the scalarised objective; for LM_TASK_REPAIR without a design, the cost of the
  relaxations */
  double violation;
  double unit[LM_FREE_MAX];
  double figure[LM_FIGURE_COUNT];
  /* solution_count feasible designs, none better than another in every objective; then, of an
   * evolving task, the member_count members of its population */
  lm_solution solution[LM_SOLUTION_MAX + LM_PARENT_MAX];
} lm_answer;

/* Charge of an answer against the budget. */
int lm_charge_of(const lm_problem *problem, const lm_answer *answer);

/* The scalarised objective that is the first objective. */
void lm_scalarise_first(lm_scalarisation *scalar);

/* Value of a scalarised objective at given objectives; bounds of the scalarised objective are not
 * counted. */
double lm_scalarised_value(const lm_problem *problem, const lm_scalarisation *scalar,
                           const double objective[]);

#ifdef __cplusplus
}
#endif

#endif
