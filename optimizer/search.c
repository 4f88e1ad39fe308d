#include "search.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "evaluate.h"
#include "found.h"
#include "lostmotion/checks.h"

#define BATCH_MAX 256 /* tasks that are out at the same time */
#define POOL_MAX 8    /* designs kept of each combination */
#define ARCHIVE_MAX 1024
#define POLISHED 4        /* combinations that are polished */
#define SETTLED_MAX 24    /* designs of the front that are settled */
#define SETTLE_SLOPES 300 /* gradients for one of them; most take a third */
#define SCREEN_POINTS 4   /* of a combination */
#define POINT_CHARGE 2    /* of a screened point: itself, and with its gap closed */
#define BRIDGE_CHARGE 6   /* of three points between two designs */
#define BRIDGES_MAX 6     /* of one round of the trade-off */
#define OTHER_SHARE 0.3   /* of the levels: a second combination is tried there */
#define LEVEL_SLOPES 15   /* gradients for one level; warm starts need no more */
#define RUNG_SLOPES 12    /* evaluations with derivatives of the first rung */
#define LEVELS_MAX 12     /* of one round of the trade-off */
#define QUIET_ROUNDS 4    /* restarts without a better design before the search ends early */

/* Shares of the budget. */
#define SCREEN_SHARE 0.15
#define EVOLVE_SHARE 0.7 /* up to here */
#define RACE_SHARE 0.03

#define ISLANDS_MAX 4
#define EPOCH_BUDGET 4000     /* evaluations of a population before the next one starts anew */
#define ISLAND_BUDGET 200     /* evaluations of one island between two exchanges */
#define FEW_EVALUATIONS 10000 /* below, two islands */

typedef struct combination_state {
  int fate;
  int limit;    /* what pruned it */
  int screened; /* a point of it was computed */
  int raced;    /* in the race */
  double value;
  double violation;
  double unit[LM_FREE_MAX];
  int pool_count;
  lm_found pool[POOL_MAX];
} combination_state;

struct lm_search {
  lm_problem problem;
  int combinations;
  combination_state *state;
  int stage;
  int rung;
  int round;
  int quiet;
  double round_best;
  int aims;      /* of the trade-off, made so far */
  int epoch_end; /* of the present population, in evaluations */
  int cursor;    /* of the screen */
  int *order;    /* of the screen, then ranking of the race */
  int runners;   /* combinations in the race */
  int next_id;
  int used;
  int plain;
  int slopes;
  int refused;
  int feasible;
  int tasks_done;
  lm_task batch[BATCH_MAX];
  int batch_count;
  int batch_first; /* id of the first task */
  lm_answer answer[BATCH_MAX];
  unsigned char answered[BATCH_MAX];
  int missing;
  lm_found archive[ARCHIVE_MAX];
  int archive_count;
  lm_found population[ISLANDS_MAX * LM_PARENT_MAX];
  int population_count;
  lm_found settled[SETTLED_MAX];
  int settled_count;
};

const char *lm_fate_name(int fate) {
  static const char *const names[LM_FATE_COUNT] = {"not reached", "pruned", "dominated", "solved"};
  return fate >= 0 && fate < LM_FATE_COUNT ? names[fate] : "";
}

/* Number number `which` of the stream of a task, 0 .. 1. */
static double draw(const lm_search *search, int id, int which) {
  const uint64_t seed = lm_mix((uint64_t)search->problem.seed ^ lm_mix((uint64_t)id));
  return (double)(lm_mix(seed + (uint64_t)which) >> 11) / 9007199254740992.0;
}

/* --- bounds -------------------------------------------------------------------------------------
 */

/* A limit that grows or falls with every variable is best at one corner of the box; the corner is
 * found variable by variable and its drive built. What even that corner breaks no design of the
 * combination keeps. The signs are those of checks.h: stress grows with rim and deflection, falls
 * with the wall; the diameter grows with all lengths. */
static int low_corner(int key) {
  return key == LM_KEY_RIM_THICKNESS_MM || key == LM_KEY_DEFLECTION_MM ||
         key == LM_KEY_DEFLECTION_MODULES || key == LM_KEY_MODULE_MM ||
         key == LM_KEY_FLEXSPLINE_SHIFT || key == LM_KEY_RIGID_SHIFT ||
         key == LM_KEY_SHIFT_DIFFERENCE || key == LM_KEY_TOOTH_HEIGHT;
}

/* Outer diameter of the smallest drive of the combination (evaluate.c), without building it: the
 * pitch radius and the ring beyond it are certain, everything else is taken at its least. */
static double least_diameter(const lm_problem *p, const double value[]) {
  const double m = value[LM_KEY_MODULE_MM];
  const double z = value[LM_KEY_FLEXSPLINE_TEETH];
  const double w = p->given[LM_KEY_DEFLECTION_MODULES] ? value[LM_KEY_DEFLECTION_MODULES] * m
                                                       : value[LM_KEY_DEFLECTION_MM];
  const int external = value[LM_KEY_DEFORMATION] > 0.5;
  const double shift = external && p->given[LM_KEY_SHIFT_DIFFERENCE]
                           ? value[LM_KEY_FLEXSPLINE_SHIFT] + value[LM_KEY_SHIFT_DIFFERENCE]
                       : external ? value[LM_KEY_RIGID_SHIFT]
                                  : value[LM_KEY_FLEXSPLINE_SHIFT];
  const double teeth = external ? z - 2 : z;
  const double root =
      m * (teeth / 2 + shift - value[LM_KEY_RACK_ADDENDUM] - value[LM_KEY_ROOT_CLEARANCE]);
  return 2 * (root + m * value[LM_KEY_TOOTH_HEIGHT] + w + 0.2 * m + 0.1 * m * z);
}

static int is_varied(const lm_problem *p, int key) {
  int i;
  for (i = 0; i < p->range_count; i++) {
    if (p->range[i].key == key) {
      return 1;
    }
  }
  return 0;
}

/* Fate by bounds. */
static void prune(lm_search *search, int combination) {
  const lm_problem *p = &search->problem;
  combination_state *state = &search->state[combination];
  double unit[LM_FREE_MAX];
  double value[LM_KEY_COUNT];
  int external;
  int ring;
  int i;
  for (i = 0; i < p->range_count; i++) {
    const int key = p->range[i].key;
    unit[i] = low_corner(key) ? 0 : 1;
    if (key == LM_KEY_RACK_ADDENDUM || key == LM_KEY_ROOT_CLEARANCE) {
      unit[i] = 1;
    }
  }
  lm_fill_values(p, combination, unit, value);
  external = value[LM_KEY_DEFORMATION] > 0.5;
  ring = (int)(value[LM_KEY_GENERATOR_TYPE] + 0.5) == LM_RING;
  if (external != ring) {
    state->fate = LM_FATE_PRUNED;
    state->limit = -1;
  } else if (p->bounds.outer_diameter_max_mm > 0 &&
             least_diameter(p, value) > p->bounds.outer_diameter_max_mm) {
    state->fate = LM_FATE_PRUNED;
    state->limit = LM_LIMIT_OUTER_DIAMETER;
  } else if (is_varied(p, LM_KEY_WALL_THICKNESS_MM) || value[LM_KEY_WALL_THICKNESS_MM] > 0) {
    /* Shear in the wall at the largest radius that the neutral line can have. */
    const double r =
        value[LM_KEY_MODULE_MM] * value[LM_KEY_FLEXSPLINE_TEETH] / 2 + 12 * value[LM_KEY_MODULE_MM];
    const double shear = p->rated_torque_Nm * 1000 /
                         (2 * 3.14159265358979323846 * r * r * value[LM_KEY_WALL_THICKNESS_MM]);
    const double allowed =
        value[LM_KEY_SHEAR_FATIGUE_MPA] > 0 ? value[LM_KEY_SHEAR_FATIGUE_MPA] : 250;
    if (shear > allowed) {
      state->fate = LM_FATE_PRUNED;
      state->limit = LM_LIMIT_TORSION_STRESS;
    }
  }
}

/* --- tasks --------------------------------------------------------------------------------------
 */

static lm_task *add_task(lm_search *search, int kind, int combination, int budget,
                         const double unit[]) {
  lm_task *task = &search->batch[search->batch_count++];
  memset(task, 0, sizeof *task);
  task->id = search->next_id++;
  task->kind = kind;
  task->combination = combination;
  task->budget = budget;
  task->seed = lm_mix((uint64_t)search->problem.seed ^ lm_mix((uint64_t)task->id));
  lm_lead_aim(&task->aim);
  if (unit != NULL) {
    memcpy(task->unit, unit, sizeof task->unit);
  }
  return task;
}

/* Move a start by up to `width` of each range. */
static void disturb(const lm_search *search, lm_task *task, double width) {
  int k;
  for (k = 0; k < search->problem.range_count; k++) {
    const double moved = task->unit[k] + width * (2 * draw(search, task->id, 100 + k) - 1);
    task->unit[k] = moved < 0 ? 0 : moved > 1 ? 1 : moved;
  }
}

/* --- screen and race ----------------------------------------------------------------------------
 */

static void start_screen(lm_search *search) {
  int i;
  for (i = 0; i < search->combinations; i++) {
    search->order[i] = i;
  }
  /* In a drawn order, so that a short budget does not always miss the same end. */
  for (i = search->combinations - 1; i > 0; i--) {
    const int k = (int)(draw(search, -1, i) * (i + 1));
    const int moved = search->order[i];
    search->order[i] = search->order[k];
    search->order[k] = moved;
  }
}

static void plan_screen(lm_search *search) {
  const double share = SCREEN_SHARE * search->problem.evaluations;
  int waiting = 0;
  int points;
  int i;
  for (i = 0; i < search->combinations; i++) {
    waiting += search->state[i].fate != LM_FATE_PRUNED;
  }
  points = waiting > 0 ? (int)(share / (POINT_CHARGE * waiting)) : 0;
  points = points < 1 ? 1 : points > SCREEN_POINTS ? SCREEN_POINTS : points;
  if (waiting <= POLISHED) {
    points = 4 * SCREEN_POINTS;
  }
  while (search->cursor < search->combinations && search->batch_count < BATCH_MAX &&
         search->used + POINT_CHARGE * points * search->batch_count < 2 * share) {
    const int combination = search->order[search->cursor++];
    if (search->state[combination].fate != LM_FATE_PRUNED) {
      (void)add_task(search, LM_TASK_SCREEN, combination, POINT_CHARGE * points, NULL);
    }
  }
}

static int is_ahead(const combination_state *a, const combination_state *b) {
  if (a->screened != b->screened) {
    return a->screened;
  }
  if (a->violation <= LM_FEASIBLE && b->violation <= LM_FEASIBLE) {
    return a->value < b->value;
  }
  return a->violation < b->violation;
}

/* Rank combinations order[0 .. count-1], best first; ties keep their order. Shell sort would not
 * keep them, so a merge by insertion of runs: count is at most LM_COMBINATION_MAX, once a rung. */
static void rank(lm_search *search, int count) {
  int i;
  for (i = 1; i < count; i++) {
    const int moved = search->order[i];
    int low = 0;
    int high = i;
    while (low < high) {
      const int middle = (low + high) / 2;
      if (is_ahead(&search->state[moved], &search->state[search->order[middle]])) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    memmove(&search->order[low + 1], &search->order[low],
            (size_t)(i - low) * sizeof search->order[0]);
    search->order[low] = moved;
  }
}

/* Designs spread over the front, its ends among them. */
static void add_spread(lm_search *search) {
  const int places = ISLANDS_MAX * LM_PARENT_MAX - search->population_count;
  const int count = search->archive_count < places ? search->archive_count : places;
  int n;
  for (n = 0; n < count; n++) {
    const int place = count > 1 ? n * (search->archive_count - 1) / (count - 1) : 0;
    search->population[search->population_count++] = search->archive[place];
  }
}

/* The best kept design of each combination, the best combinations first. */
static void add_champions(lm_search *search) {
  int screened = 0;
  int i;
  for (i = 0; i < search->combinations; i++) {
    if (search->state[i].screened) {
      search->order[screened++] = i;
    }
  }
  rank(search, screened);
  for (i = 0; i < screened && search->population_count < ISLANDS_MAX * LM_PARENT_MAX / 2; i++) {
    const combination_state *state = &search->state[search->order[i]];
    if (state->pool_count > 0) {
      search->population[search->population_count++] = state->pool[0];
    }
  }
}

/* Islands start from the screened designs. */
static void start_population(lm_search *search) {
  search->population_count = 0;
  add_champions(search);
  search->epoch_end = search->problem.evaluations < FEW_EVALUATIONS ? search->problem.evaluations
                                                                    : search->used + EPOCH_BUDGET;
}

/* A population settles in one region, so that a larger budget goes into several which start anew;
 * the last one, with half of the share, starts from what all have found. */
static void start_epoch(lm_search *search, double share) {
  search->population_count = 0;
  if (search->used + EPOCH_BUDGET <= share / 2) {
    search->epoch_end = search->used + EPOCH_BUDGET;
    return;
  }
  search->epoch_end = search->problem.evaluations;
  add_champions(search);
  add_spread(search);
}

/* Islands exchange by dealing the population out anew, best first in turn. */
static void plan_evolve(lm_search *search) {
  const int islands = search->problem.evaluations < FEW_EVALUATIONS ? ISLANDS_MAX / 2 : ISLANDS_MAX;
  const double share = EVOLVE_SHARE * search->problem.evaluations;
  int i;
  int k;
  if (search->used + islands * ISLAND_BUDGET / 2 > share) {
    return;
  }
  if (search->used >= search->epoch_end) {
    start_epoch(search, share);
  }
  for (i = 0; i < islands; i++) {
    lm_task *task = add_task(search, LM_TASK_EVOLVE, 0, ISLAND_BUDGET, NULL);
    for (k = i; k < search->population_count && task->parent_count < LM_PARENT_MAX; k += islands) {
      task->parent[task->parent_count++] = search->population[k];
    }
  }
}

/* How many combinations the share of the race carries through all rungs: each rung costs the same,
 * as the runners halve and their budget doubles. */
static void start_race(lm_search *search) {
  const double budget =
      RACE_SHARE * search->problem.evaluations / (RUNG_SLOPES * lm_slope_charge(&search->problem));
  int screened = 0;
  int runners = 1;
  int i;
  for (i = 0; i < search->combinations; i++) {
    if (search->state[i].screened) {
      search->order[screened++] = i;
      search->state[i].fate = LM_FATE_DOMINATED;
    }
  }
  rank(search, screened);
  while (runners < screened) {
    int rungs = 1;
    while ((1 << rungs) < runners + 1) {
      rungs++;
    }
    if ((runners + 1) * rungs > budget) {
      break;
    }
    runners++;
  }
  search->runners = runners < screened ? runners : screened;
  search->rung = 0;
}

/* Gradients and no gradients by turns: what one kind sticks at the other passes. */
static void plan_race(lm_search *search) {
  int i;
  if (search->runners <= (search->rung == 0 ? 0 : POLISHED / 2)) {
    return;
  }
  for (i = 0; i < search->runners && search->batch_count < BATCH_MAX; i++) {
    const int combination = search->order[i];
    (void)add_task(search, search->rung % 2 == 0 ? LM_TASK_SLSQP : LM_TASK_COBYLA, combination,
                   (RUNG_SLOPES << search->rung) * lm_slope_charge(&search->problem),
                   search->state[combination].unit);
  }
}

/* A share of what is left of the budget, on as many combinations as it carries: half of it for one
 * objective; with more the ends of the front are but a part of the work. */
static void plan_polish(lm_search *search) {
  const double share = search->problem.objective_count > 1 ? 0.2 : 0.5;
  const int left = (int)((search->problem.evaluations - search->used) * share);
  int slopes = 40 * lm_slope_charge(&search->problem);
  int polished = left / (3 * 10 * lm_slope_charge(&search->problem));
  int screened = 0;
  int i;
  for (i = 0; i < search->combinations; i++) {
    screened += search->state[i].screened;
  }
  polished = polished < POLISHED ? polished : POLISHED;
  polished = polished < 1 ? 1 : polished;
  polished = polished < screened ? polished : screened;
  for (i = 0; i < polished; i++) {
    combination_state *state = &search->state[search->order[i]];
    lm_task *task;
    slopes = left / (3 * polished) < slopes ? left / (3 * polished) : slopes;
    state->fate = LM_FATE_SOLVED;
    (void)add_task(search, LM_TASK_SLSQP, search->order[i], slopes, state->unit);
    (void)add_task(search, LM_TASK_COBYLA, search->order[i], slopes, state->unit);
    task = add_task(search, LM_TASK_SLSQP, search->order[i], slopes, state->unit);
    disturb(search, task, 0.15);
  }
}

/* --- restarts of one objective ------------------------------------------------------------------
 */

/* A combination to try: mostly the best ones, now and then any that was screened. */
static int pick_combination(const lm_search *search, int id) {
  int screened = 0;
  int i;
  for (i = 0; i < search->combinations; i++) {
    screened += search->state[i].screened;
  }
  if (draw(search, id, 1) < 0.7) {
    const int best = screened < POLISHED ? screened : POLISHED;
    return search->order[(int)(draw(search, id, 2) * best)];
  }
  i = 2 * search->runners + POLISHED;
  i = i < screened ? i : screened;
  return search->order[(int)(draw(search, id, 2) * i)];
}

static void plan_restarts(lm_search *search) {
  const int left = search->problem.evaluations - search->used;
  const int charge = 30 * lm_slope_charge(&search->problem);
  int i;
  if (left < charge / 2 || search->quiet >= QUIET_ROUNDS) {
    return;
  }
  if (search->round == 0 && search->problem.evaluations >= 10000) {
    const int best = search->order[0];
    (void)add_task(search, LM_TASK_ISRES, best, search->problem.evaluations / 20,
                   search->state[best].unit);
  }
  for (i = 0; i < 8 && (i == 0 || (i + 1) * charge <= left); i++) {
    const int combination = pick_combination(search, search->next_id);
    lm_task *task = add_task(search, i % 2 == 0 ? LM_TASK_COBYLA : LM_TASK_SLSQP, combination,
                             charge < left ? charge : left, search->state[combination].unit);
    disturb(search, task, 0.05 + 0.25 * draw(search, task->id, 3));
  }
}

/* --- trade-off ----------------------------------------------------------------------------------
 */

static void range_of(const lm_search *search, int j, double *low, double *high) {
  int i;
  *low = search->archive[0].objective[j];
  *high = *low;
  for (i = 1; i < search->archive_count; i++) {
    const double f = search->archive[i].objective[j];
    *low = f < *low ? f : *low;
    *high = f > *high ? f : *high;
  }
}

static void scale_aim(const lm_search *search, lm_aim *aim) {
  int j;
  for (j = 0; j < search->problem.objective_count; j++) {
    double low;
    double high;
    range_of(search, j, &low, &high);
    aim->origin[j] = low;
    aim->scale[j] = high - low > 1e-6 * fabs(high) ? high - low : fabs(high) + 1e-12;
  }
}

static int meets(const lm_problem *p, const lm_aim *aim, const double objective[]) {
  int j;
  for (j = 0; j < p->objective_count; j++) {
    if (objective[j] > aim->most[j]) {
      return 0;
    }
  }
  return 1;
}

/* The best kept design of a combination for an aim, null: none meets its bounds. */
static const lm_found *best_of_pool(const lm_search *search, int combination, const lm_aim *aim,
                                    double *value) {
  const combination_state *state = &search->state[combination];
  const lm_found *best = NULL;
  int i;
  for (i = 0; i < state->pool_count; i++) {
    const double here = lm_aim_value(&search->problem, aim, state->pool[i].objective);
    if (meets(&search->problem, aim, state->pool[i].objective) && (best == NULL || here < *value)) {
      best = &state->pool[i];
      *value = here;
    }
  }
  return best;
}

static const lm_found *best_of_archive(const lm_search *search, const lm_aim *aim) {
  const lm_found *best = &search->archive[0];
  double least = HUGE_VAL;
  int i;
  for (i = 0; i < search->archive_count; i++) {
    const double value = lm_aim_value(&search->problem, aim, search->archive[i].objective);
    if (meets(&search->problem, aim, search->archive[i].objective) && value < least) {
      best = &search->archive[i];
      least = value;
    }
  }
  return best;
}

/* The best design of any other combination for the aim. */
static const lm_found *best_other(const lm_search *search, const lm_aim *aim, int but) {
  const lm_found *best = NULL;
  double least = HUGE_VAL;
  int i;
  for (i = 0; i < search->combinations; i++) {
    double value = 0;
    const lm_found *here = i == but ? NULL : best_of_pool(search, i, aim, &value);
    if (here != NULL && value < least) {
      best = here;
      least = value;
    }
  }
  return best;
}

/* Middle of the largest gaps between neighbours of the front: level number `which` from the widest.
 */
static double gap_level(const lm_search *search, const lm_aim *aim, int which) {
  double taken = HUGE_VAL;
  double level = search->archive[0].objective[1];
  int n;
  for (n = 0; n <= which; n++) {
    double widest = -1;
    int i;
    for (i = 0; i + 1 < search->archive_count; i++) {
      const double *a = search->archive[i].objective;
      const double *b = search->archive[i + 1].objective;
      const double width =
          (b[0] - a[0]) / aim->scale[0] * (a[1] - b[1]) / aim->scale[1]; /* area at stake */
      if (width > widest && width < taken) {
        widest = width;
        level = (a[1] + b[1]) / 2;
      }
    }
    if (widest < 0) {
      break;
    }
    taken = widest;
  }
  return level;
}

/* Two objectives: the second one bounded at a level, the first one made small; every sixth task
 * makes the second one small. */
static void make_level(const lm_search *search, int level, int levels, lm_aim *aim) {
  double low;
  double high;
  range_of(search, 1, &low, &high);
  if (level == 0 && search->round % 2 == 0) {
    aim->weight[0] = 0;
    aim->weight[1] = 1;
  } else if (level % 2 == 0) {
    aim->most[1] = low + (high - low) * (level + draw(search, search->next_id, 5)) / levels;
  } else {
    aim->most[1] = gap_level(search, aim, level / 2);
  }
}

/* More objectives: the end of each axis, then twice as many drawn directions, and so on. */
static void make_direction(const lm_search *search, lm_aim *aim) {
  const int count = search->problem.objective_count;
  const int turn = search->aims % (3 * count);
  int j;
  for (j = 0; j < count; j++) {
    if (turn < count) {
      aim->weight[j] = j == turn ? 1 : 0;
    } else {
      aim->weight[j] = -log(1 - draw(search, search->next_id, 10 + j)) + 1e-3;
    }
  }
}

static void make_aim(lm_search *search, int level, int levels, lm_aim *aim) {
  lm_lead_aim(aim);
  scale_aim(search, aim);
  if (search->problem.objective_count == 2) {
    make_level(search, level, levels, aim);
  } else {
    make_direction(search, aim);
  }
  search->aims++;
}

/* The steps of the front with the largest area at stake, where both ends are designs of one
 * combination. */
static void plan_bridges(lm_search *search, int left) {
  unsigned char bridged[ARCHIVE_MAX] = {0};
  int n;
  for (n = 0; n < BRIDGES_MAX && (n + 1) * BRIDGE_CHARGE <= left; n++) {
    lm_task *task;
    double most = 0;
    int widest = -1;
    int i;
    for (i = 0; i + 1 < search->archive_count; i++) {
      const lm_found *a = &search->archive[i];
      const lm_found *b = a + 1;
      const double area = (b->objective[0] - a->objective[0]) * (a->objective[1] - b->objective[1]);
      if (!bridged[i] && a->combination == b->combination && area > most) {
        most = area;
        widest = i;
      }
    }
    if (widest < 0) {
      return;
    }
    bridged[widest] = 1;
    task = add_task(search, LM_TASK_BRIDGE, search->archive[widest].combination, BRIDGE_CHARGE,
                    search->archive[widest].unit);
    task->parent[0] = search->archive[widest + 1];
    task->parent_count = 1;
  }
}

/* Without any feasible design yet: restarts until one is met. */
static void plan_front(lm_search *search) {
  const int charge = LEVEL_SLOPES * lm_slope_charge(&search->problem);
  const int left = search->problem.evaluations - search->used;
  int levels = left / (3 * charge) / 3;
  int level;
  if (search->archive_count == 0) {
    plan_restarts(search);
    return;
  }
  if (left < charge / 2) {
    return;
  }
  levels = levels < 2 ? 2 : levels > LEVELS_MAX ? LEVELS_MAX : levels;
  if (search->problem.objective_count == 2 && search->round % 2 == 1) {
    plan_bridges(search, left);
    if (search->batch_count > 0) {
      return;
    }
  }
  for (level = 0; level < levels; level++) {
    lm_aim aim;
    const lm_found *start;
    const lm_found *other;
    lm_task *task;
    if (level > 0 && (search->batch_count + 1) * charge > left) {
      return;
    }
    make_aim(search, level, levels, &aim);
    start = best_of_archive(search, &aim);
    task = add_task(search, (level + search->round) % 3 != 1 ? LM_TASK_SLSQP : LM_TASK_COBYLA,
                    start->combination, charge < left ? charge : left, start->unit);
    task->aim = aim;
    if (draw(search, task->id, 6) < 0.1) {
      disturb(search, task, 0.1);
    }
    /* at the end of an axis always: another combination may reach further */
    other = aim.weight[0] == 0 || draw(search, search->next_id, 7) < OTHER_SHARE
                ? best_other(search, &aim, start->combination)
                : NULL;
    if (other != NULL && (search->batch_count + 1) * charge <= left) {
      task = add_task(search, LM_TASK_SLSQP, other->combination, charge, other->unit);
      task->aim = aim;
    }
    if ((level + search->round) % 3 == 0 && (search->batch_count + 1) * charge <= left) {
      const int combination = pick_combination(search, search->next_id);
      task = add_task(search, LM_TASK_SLSQP, combination, charge, search->state[combination].unit);
      task->aim = aim;
      disturb(search, task, 0.1);
    }
  }
}

/* --- settling -----------------------------------------------------------------------------------
 */

/* Designs of the front spread over it, each kept near where it is: the largest worsening over the
 * objectives is made small. */
static void plan_settle(lm_search *search) {
  const int wanted = search->archive_count < SETTLED_MAX ? search->archive_count : SETTLED_MAX;
  int n;
  for (n = 0; n < wanted; n++) {
    const int place = wanted > 1 ? n * (search->archive_count - 1) / (wanted - 1) : 0;
    const lm_found *found = &search->archive[place];
    lm_task *task = add_task(search, LM_TASK_SETTLE, found->combination,
                             SETTLE_SLOPES * lm_slope_charge(&search->problem), found->unit);
    if (search->problem.objective_count > 1) {
      int j;
      scale_aim(search, &task->aim);
      for (j = 0; j < search->problem.objective_count; j++) {
        task->aim.weight[j] = 1;
        task->aim.origin[j] = found->objective[j];
      }
    }
  }
}

/* --- the sequence -------------------------------------------------------------------------------
 */

/* Share what is left of the budget when a batch asks for more. */
static void keep_budget(lm_search *search) {
  const double left = search->problem.evaluations - search->used;
  double wanted = 0;
  int i;
  for (i = 0; i < search->batch_count; i++) {
    wanted += search->batch[i].budget;
  }
  for (i = 0; i < search->batch_count && wanted > left; i++) {
    /* nothing wanted and less than nothing left: 0 / 0 is no number */
    const int budget = left > 0 ? (int)(search->batch[i].budget * left / wanted) : 1;
    search->batch[i].budget = budget > 1 ? budget : 1;
  }
}

/* Fill the next batch; leaves it empty when the search has ended. */
static void plan(lm_search *search) {
  search->batch_count = 0;
  search->batch_first = search->next_id;
  while (search->batch_count == 0 && search->stage != LM_STAGE_DONE) {
    switch (search->stage) {
      case LM_STAGE_SCREEN:
        plan_screen(search);
        break;
      case LM_STAGE_EVOLVE:
        plan_evolve(search);
        break;
      case LM_STAGE_RACE:
        plan_race(search);
        break;
      case LM_STAGE_POLISH:
        if (search->round == 0) {
          plan_polish(search);
        }
        break;
      case LM_STAGE_SPREAD:
        if (search->runners > 0) {
          search->problem.objective_count > 1 ? plan_front(search) : plan_restarts(search);
        }
        break;
      case LM_STAGE_SETTLE:
      default:
        if (search->round == 0) {
          plan_settle(search);
        }
        break;
    }
    if (search->batch_count == 0) {
      search->stage++;
      search->round = 0;
      search->quiet = 0;
      if (search->stage == LM_STAGE_EVOLVE) {
        start_population(search);
      } else if (search->stage == LM_STAGE_RACE) {
        start_race(search);
      }
    }
  }
  if (search->stage < LM_STAGE_SETTLE) {
    keep_budget(search);
  }
  memset(search->answered, 0, sizeof search->answered);
  search->missing = search->batch_count;
}

/* A combination's own best is by the first objective. */
static void improve_state(combination_state *state, double value, double violation,
                          const double unit[]) {
  combination_state now = *state;
  now.screened = 1;
  now.value = value;
  now.violation = violation;
  if (!state->screened || is_ahead(&now, state)) {
    state->value = value;
    state->violation = violation;
    memcpy(state->unit, unit, sizeof state->unit);
  }
  state->screened = 1;
}

/* Members of the islands gather until the batch is complete. */
static void gather_members(lm_search *search, const lm_answer *answer) {
  int i;
  for (i = 0; i < answer->member_count; i++) {
    const lm_found *member = &answer->found[answer->found_count + i];
    improve_state(&search->state[member->combination], member->objective[0], member->violation,
                  member->unit);
    if (search->population_count < ISLANDS_MAX * LM_PARENT_MAX) {
      search->population[search->population_count++] = *member;
    }
  }
}

static void reduce_answer(lm_search *search, const lm_task *task, const lm_answer *answer) {
  const lm_problem *p = &search->problem;
  int i;
  search->plain += answer->plain;
  search->slopes += answer->slopes;
  search->refused += answer->refused;
  search->feasible += answer->feasible;
  search->tasks_done++;
  if (task->kind == LM_TASK_SETTLE) {
    for (i = 0; i < answer->found_count; i++) {
      lm_insert_found(p, search->settled, &search->settled_count, SETTLED_MAX, &answer->found[i]);
    }
    return;
  }
  search->used += lm_charge_of(p, answer);
  for (i = 0; i < answer->found_count; i++) {
    const lm_found *found = &answer->found[i];
    combination_state *state = &search->state[found->combination];
    lm_insert_found(p, search->archive, &search->archive_count, ARCHIVE_MAX, found);
    lm_insert_found(p, state->pool, &state->pool_count, POOL_MAX, found);
    improve_state(state, found->objective[0], 0, found->unit);
  }
  gather_members(search, answer);
  if (answer->computed && answer->violation > LM_FEASIBLE) {
    improve_state(&search->state[answer->combination], answer->value, answer->violation,
                  answer->unit);
  }
}

/* The batch is complete: take the answers in the order of the tasks, then plan what follows. */
static void reduce(lm_search *search) {
  double best = HUGE_VAL;
  int screened = 0;
  int i;
  if (search->stage == LM_STAGE_EVOLVE) {
    search->population_count = 0;
  }
  for (i = 0; i < search->batch_count; i++) {
    reduce_answer(search, &search->batch[i], &search->answer[i]);
  }
  lm_sort_found(search->archive, search->archive_count);
  lm_sort_found(search->settled, search->settled_count);
  if (search->archive_count > 0) {
    best = search->archive[0].objective[0];
  }
  search->quiet = best < search->round_best - 1e-4 * fabs(best) ? 0 : search->quiet + 1;
  search->round_best = best;
  search->round++;
  if (search->stage == LM_STAGE_EVOLVE) {
    lm_select_found(&search->problem, search->population, search->population_count,
                    search->population_count);
  }
  if (search->stage == LM_STAGE_RACE) {
    rank(search, search->runners);
    search->runners = (search->runners + 1) / 2;
    search->rung++;
    if (search->rung > 20 || search->runners == 1) {
      search->stage = LM_STAGE_POLISH;
      search->round = 0;
    }
  } else if (search->stage == LM_STAGE_POLISH || search->stage == LM_STAGE_SPREAD) {
    for (i = 0; i < search->combinations; i++) {
      if (search->state[i].screened) {
        search->order[screened++] = i;
      }
    }
    rank(search, screened);
  }
  plan(search);
}

lm_search *lm_open_search(const lm_problem *problem) {
  lm_search *search = (lm_search *)calloc(1, sizeof *search);
  int i;
  if (search == NULL) {
    return NULL;
  }
  search->problem = *problem;
  search->combinations = lm_count_combinations(problem);
  search->state = (combination_state *)calloc((size_t)search->combinations, sizeof *search->state);
  search->order = (int *)calloc((size_t)search->combinations, sizeof *search->order);
  if (search->state == NULL || search->order == NULL) {
    lm_close_search(search);
    return NULL;
  }
  search->round_best = HUGE_VAL;
  for (i = 0; i < search->combinations; i++) {
    search->state[i].violation = HUGE_VAL;
    search->state[i].value = HUGE_VAL;
    prune(search, i);
  }
  start_screen(search);
  plan(search);
  return search;
}

void lm_close_search(lm_search *search) {
  if (search != NULL) {
    free(search->state);
    free(search->order);
    free(search);
  }
}

int lm_next_tasks(lm_search *search, const lm_task **tasks) {
  *tasks = search->batch;
  return search->batch_count;
}

int lm_is_answered(const lm_search *search, int id) {
  const int place = id - search->batch_first;
  return place < 0 || (place < search->batch_count && search->answered[place]);
}

lm_status lm_accept_answer(lm_search *search, const lm_answer *answer) {
  int place;
  if (search == NULL || answer == NULL) {
    return LM_NULL;
  }
  place = answer->id - search->batch_first;
  if (answer->id < 0 || place >= search->batch_count ||
      (place >= 0 && answer->combination != search->batch[place].combination)) {
    return LM_OUT_OF_RANGE;
  }
  if (lm_is_answered(search, answer->id)) {
    return LM_OK;
  }
  search->answer[place] = *answer;
  search->answered[place] = 1;
  search->missing--;
  if (search->missing == 0) {
    reduce(search);
  }
  return LM_OK;
}

/* --- reading ------------------------------------------------------------------------------------
 */

int lm_read_front(const lm_search *search, lm_found front[], int capacity) {
  const lm_found *list = search->settled_count > 0 ? search->settled : search->archive;
  const int count = search->settled_count > 0 ? search->settled_count : search->archive_count;
  const int written = count < capacity ? count : capacity;
  if (written > 0) {
    memcpy(front, list, (size_t)written * sizeof list[0]);
  }
  return count;
}

int lm_read_best(const lm_search *search, lm_found *best) {
  return lm_read_front(search, best, 1) > 0;
}

int lm_read_fate(const lm_search *search, int combination, int *limit) {
  *limit = search->state[combination].limit;
  return search->state[combination].fate;
}

int lm_read_nearest(const lm_search *search, int *combination, double unit[LM_FREE_MAX],
                    double *violation) {
  int found = 0;
  int i;
  for (i = 0; i < search->combinations; i++) {
    const combination_state *state = &search->state[i];
    if (state->screened && (!found || state->violation < *violation)) {
      found = 1;
      *combination = i;
      *violation = state->violation;
      memcpy(unit, state->unit, sizeof state->unit);
    }
  }
  return found;
}

void lm_read_progress(const lm_search *search, lm_progress *progress) {
  const int evaluations = search->plain + search->slopes;
  lm_found best;
  int i;
  memset(progress, 0, sizeof *progress);
  progress->stage = search->stage;
  progress->evaluations = search->used;
  progress->budget = search->problem.evaluations;
  progress->feasible_share = evaluations > 0 ? (double)search->feasible / evaluations : 0;
  progress->refused = search->refused;
  progress->tasks_done = search->tasks_done;
  progress->front_size = lm_read_front(search, NULL, 0);
  progress->has_best = progress->front_size > 0 && lm_read_best(search, &best);
  if (progress->has_best) {
    progress->best_combination = best.combination;
    progress->best_value = best.objective[0];
  }
  for (i = 0; i < search->combinations; i++) {
    progress->fate[search->state[i].fate]++;
  }
}
