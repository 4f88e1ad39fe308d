/* State of the search between batches, and requests of the stages; only the files of the search
 * include this. */
#ifndef LOSTMOTION_OPTIMIZER_SEARCH_STATE_H
#define LOSTMOTION_OPTIMIZER_SEARCH_STATE_H

#include "points.h"
#include "stage.h"
#include "task.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LM_BATCH_MAX 256 /* tasks that are out at the same time */
#define LM_POOL_MAX 8    /* designs kept of each combination */
#define LM_ARCHIVE_MAX 1024
#define LM_VERIFIED_MAX 24 /* designs of the front that are solved again for that */
#define LM_POLISHED 4      /* combinations that are polished */
#define LM_REPAIRED 8      /* tasks that search for a first design if none was found */
#define LM_ISLANDS_MAX 4

typedef struct lm_combination_state {
  int fate;
  int limit;    /* what pruned it */
  int screened; /* a point of it was computed */
  int raced;    /* in the race */
  int solved;   /* times that the solver started in it */
  double value;
  double violation;
  double unit[LM_FREE_MAX];
  double least[LM_OBJECTIVE_MAX]; /* of its kept designs, when the population recalls the front */
  int pool_count;
  lm_solution pool[LM_POOL_MAX];
} lm_combination_state;

/* Steps of the verification: round the grades, check all designs, start a solver from some, and
 * if none is within the limits, from their neighbours. */
typedef enum lm_verify_step {
  LM_VERIFY_ROUND = 0,
  LM_VERIFY_CONFIRM,
  LM_VERIFY_SOLVE,
  LM_VERIFY_NEIGHBOURS,
  LM_VERIFY_DONE
} lm_verify_step;

struct lm_search {
  lm_problem problem;
  int combinations;
  lm_combination_state *state;
  int stage;
  int rung;            /* of the race: halvings of the field so far */
  int round;           /* of the present stage, from 0 */
  int quiet;           /* successive rounds without significant improvement of the best design */
  double round_best;   /* first objective of the best design, one round ago */
  int scalarisations;  /* of the trade-off, made so far */
  int extremes_sought; /* of the front, for the population */
  int ends_looked;     /* times that the ends of the other combinations were examined */
  int evolved;         /* evaluations of the population */
  int solver_used;     /* and of the solver beside it */
  int epoch_end;       /* of the present population, in evaluations */
  int started;         /* designs to begin with that were examined */
  int cursor;          /* of the screen */
  int *order;          /* of the screen, then ranking of the race */
  int runners;         /* combinations in the race */
  int next_id;
  int used;
  int plain;
  int slopes;
  int refused;
  int feasible;
  int tasks_done;
  lm_task batch[LM_BATCH_MAX];
  int batch_count;
  int batch_first; /* id of the first task */
  lm_answer answer[LM_BATCH_MAX];
  unsigned char answered[LM_BATCH_MAX];
  int missing;
  lm_solution archive[LM_ARCHIVE_MAX];
  int archive_count;
  lm_solution population[LM_ISLANDS_MAX * LM_PARENT_MAX];
  int population_count;
  lm_solution verified[LM_ARCHIVE_MAX];
  int verified_count;
  lm_solution rounded[LM_ARCHIVE_MAX]; /* the archive with whole grades */
  int rounded_count;
  int verify_step;                         /* lm_verify_step */
  int verify_cursor;                       /* designs of the step's list that were distributed */
  unsigned char confirmed[LM_ARCHIVE_MAX]; /* 1: of the rounded designs that hold */
  int verify_used;                         /* charged so far for the verification */
  int has_nearest; /* the following members: the design with the least total relaxation */
  int nearest;     /* combination */
  double nearest_slack;
  double nearest_violation;
  double nearest_unit[LM_FREE_MAX];
};

/* The random number at place `which` of the stream that belongs to the task `id`, 0 .. 1. */
double lm_draw_number(const lm_search *search, int id, int which);

/* One more task of the batch, for the first objective alone. */
lm_task *lm_add_task(lm_search *search, int kind, int combination, int budget, const double unit[]);

/* Move a start by up to `width` of each range. */
void lm_disturb(const lm_search *search, lm_task *task, double width);

/* Combinations of which a point was computed, except the pruned ones. */
int lm_count_screened(const lm_search *search);

/* Rank combinations order[0 .. count-1], best first; ties keep their order. */
void lm_rank(lm_search *search, int count);

/* The same of those that were screened; their number. */
int lm_rank_screened(lm_search *search);

/* Whether the best of a screened combination is better than another's. */
int lm_is_ahead(const lm_combination_state *a, const lm_combination_state *b);

#ifdef __cplusplus
}
#endif

#endif
