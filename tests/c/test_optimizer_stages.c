/* The search as a sequence with artificial answers: for any results and costs of the tasks it ends,
 * counts correctly and requests valid tasks. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "archive.h"
#include "search.h"
#include "spec.h"
#include "test.h"

#define FRONT_MAX 1024

/* Answers of the artificial model. */
typedef struct world {
  double feasible;   /* share of the points */
  double overrun;    /* cost of a task as a share of its budget */
  int computed;      /* 0: the model refuses every point */
  int flat;          /* 1: no objective differs */
  int single;        /* 1: every task finds the same design */
  int from_members;  /* members that a task of any kind reports; 0: as in the search */
  int nothing_holds; /* 1: no design is confirmed or verified */
} world;

static const world plain = {0.5, 1, 1, 0, 0, 0, 0};

static lm_problem problem;
static lm_search *search;
static lm_answer *answer;
static int kinds[LM_TASK_VERIFY + 1];
static int batches;
static int largest_batch;
static int dealt;              /* parents of the last population, both islands */
static int dealt_combinations; /* and their combinations */
static int ends_left_out;      /* of the front of each combination, where a full population bred */
static int recalls;            /* of such populations */
static int ends;               /* tasks of a local solver beside those of a population */
static int ends_from;          /* evaluations before the first of them */
static int most_for_ends;      /* evaluations for those of one batch */
static int looks;              /* at the ends with other combinations, beside a population */
static int bred;               /* evaluations of the population */
static int solved;             /* and of the local solver beside it */
static int restarted;          /* its tasks that start away from the designs found */
static int into_front;         /* and those from a design of the front */
static lm_answer cheapest;     /* of the repairs */

void setUp(void) {
  search = NULL;
  answer = (lm_answer *)malloc(sizeof *answer);
  TEST_ASSERT_NOT_NULL(answer);
}

void tearDown(void) {
  lm_close_search(search);
  free(answer);
}

static double share(uint64_t *state) {
  *state = lm_mix(*state);
  return (double)(*state >> 11) / 9007199254740992.0;
}

/* A design of a random point: one objective gains what the next one loses. */
static void make_found(const world *w, uint64_t *state, int combination, lm_solution *found) {
  double unit[LM_FREE_MAX] = {0};
  double objective[LM_OBJECTIVE_MAX];
  double sum = 0;
  int j;
  for (j = 0; j < problem.range_count; j++) {
    unit[j] = w->single ? 0.5 : share(state);
  }
  for (j = 0; j < problem.objective_count; j++) {
    objective[j] = w->flat ? 1 : 1 + unit[j % problem.range_count] + 0.01 * (combination % 7);
    sum += objective[j];
  }
  if (problem.objective_count > 1 && !w->flat) {
    objective[problem.objective_count - 1] = 20 / sum;
  }
  lm_fill_solution(&problem, found, combination, unit, objective,
                   w->single || share(state) < w->feasible ? 0 : share(state));
}

static void add_designs(const world *w, const lm_task *task, uint64_t *state) {
  int i;
  for (i = 0; i < 12; i++) {
    lm_solution found;
    int combination = task->combination;
    if (task->kind == LM_TASK_EVOLVE) {
      combination = (int)(share(state) * lm_count_combinations(&problem));
    }
    make_found(w, state, combination, &found);
    found.verified = task->kind >= LM_TASK_CONFIRM;
    if (found.violation <= 0 && (!found.verified || !w->nothing_holds)) {
      lm_insert_solution(&problem, answer->solution, &answer->solution_count, LM_SOLUTION_MAX,
                         &found);
    }
    answer->computed = 1;
    answer->violation = found.violation;
    answer->value = found.objective[0];
    memcpy(answer->unit, found.unit, sizeof answer->unit);
  }
}

static void make_up(const world *w, const lm_task *task) {
  uint64_t state = task->seed;
  int members = task->kind == LM_TASK_EVOLVE ? LM_PARENT_MAX : w->from_members;
  int i;
  memset(answer, 0, sizeof *answer);
  answer->id = task->id;
  answer->combination = task->combination;
  answer->plain = (int)(task->budget * w->overrun);
  if (!w->computed) {
    answer->refused = answer->plain;
    return;
  }
  add_designs(w, task, &state);
  for (i = 0; i < members; i++) {
    make_found(w, &state, (int)(share(&state) * lm_count_combinations(&problem)),
               &answer->solution[answer->solution_count + i]);
  }
  answer->member_count = members;
}

/* Conditions of every task of every search. */
static void check_task(const lm_task *task) {
  int limit;
  int k;
  TEST_ASSERT_TRUE(task->kind >= 0 && task->kind <= LM_TASK_VERIFY);
  TEST_ASSERT_GREATER_THAN_INT(0, task->budget);
  TEST_ASSERT_TRUE(task->combination >= 0 && task->combination < lm_count_combinations(&problem));
  if (task->kind != LM_TASK_EVOLVE) {
    TEST_ASSERT_TRUE(lm_read_fate(search, task->combination, &limit) != LM_FATE_PRUNED);
  }
  for (k = 0; k < problem.range_count; k++) {
    TEST_ASSERT_TRUE(task->unit[k] >= 0 && task->unit[k] <= 1);
  }
  TEST_ASSERT_TRUE(task->parent_count >= 0 && task->parent_count <= LM_PARENT_MAX);
  for (k = 0; k < task->parent_count; k++) {
    /* a design that was found: no objective of this model is 0 */
    TEST_ASSERT_TRUE(task->parent[k].objective[0] > 0);
  }
  kinds[task->kind]++;
}

static void check_books(void) {
  lm_progress progress;
  int combinations = 0;
  int fate;
  lm_read_progress(search, &progress);
  for (fate = 0; fate < LM_FATE_COUNT; fate++) {
    combinations += progress.fate[fate];
  }
  TEST_ASSERT_EQUAL_INT(lm_count_combinations(&problem), combinations);
  TEST_ASSERT_EQUAL_INT(lm_read_front(search, NULL, 0), progress.front_size);
  TEST_ASSERT_EQUAL_INT(progress.front_size > 0, progress.has_best);
  TEST_ASSERT_TRUE(progress.work_done >= progress.evaluations);
  TEST_ASSERT_TRUE(progress.work_total >= progress.work_done);
  TEST_ASSERT_TRUE(progress.stage != LM_STAGE_DONE || progress.work_total == progress.work_done);
}

static void check_front(void) {
  static lm_solution front[FRONT_MAX];
  const int count = lm_read_front(search, front, FRONT_MAX);
  int i;
  TEST_ASSERT_LESS_OR_EQUAL_INT(FRONT_MAX, count);
  for (i = 1; i < count; i++) {
    int better = 0;
    int worse = 0;
    int j;
    for (j = 0; j < problem.objective_count; j++) {
      better += front[i].objective[j] < front[i - 1].objective[j];
      worse += front[i].objective[j] > front[i - 1].objective[j];
    }
    TEST_ASSERT_TRUE(better > 0 && worse > 0);
    TEST_ASSERT_TRUE(front[i].objective[0] >= front[i - 1].objective[0]);
  }
}

static int used(void) {
  lm_progress progress;
  lm_read_progress(search, &progress);
  return progress.evaluations;
}

/* Each end of the front is one objective, in the order of the objectives and relative to the front:
 * a solver's steps depend on the unit. */
static void count_end(const lm_task *task) {
  static lm_solution front[FRONT_MAX];
  const int count = lm_read_front(search, front, FRONT_MAX);
  const int wanted = ends++ % problem.objective_count;
  int i;
  int j;
  ends_from = ends == 1 ? used() : ends_from;
  TEST_ASSERT_EQUAL_INT(LM_TASK_SLSQP, task->kind);
  for (j = 0; j < problem.objective_count; j++) {
    TEST_ASSERT_TRUE(task->scalar.weight[j] == (j == wanted));
    TEST_ASSERT_TRUE(task->scalar.most[j] == HUGE_VAL);
    for (i = 0; i < count; i++) {
      const double place = (front[i].objective[j] - task->scalar.origin[j]) / task->scalar.scale[j];
      TEST_ASSERT_TRUE(place >= 0 && place <= 1 + 1e-9);
    }
  }
}

/* Of two objectives, between the ends: the first one alone or both, relative to the front. */
static void count_solver_task(const lm_task *task) {
  int j;
  TEST_ASSERT_EQUAL_INT(2, problem.objective_count);
  TEST_ASSERT_EQUAL_INT(LM_TASK_SLSQP, task->kind);
  TEST_ASSERT_TRUE(task->scalar.weight[0] > 0);
  for (j = 0; j < 2; j++) {
    TEST_ASSERT_TRUE(task->scalar.scale[j] > 0 && task->scalar.most[j] == HUGE_VAL);
  }
  restarted += task->scalar.weight[1] == 0;
  into_front += task->scalar.weight[1] > 0;
  solved += task->budget;
}

/* Tasks of a local solver that the batch of a population has. */
static int count_beside(const lm_task batch[], int count) {
  int beside = 0;
  int i;
  for (i = 0; i < count && batch[0].kind == LM_TASK_EVOLVE; i++) {
    beside += batch[i].kind != LM_TASK_EVOLVE && batch[i].kind != LM_TASK_EVALUATE;
  }
  return beside;
}

static void count_dealt(const lm_task batch[], int count) {
  static unsigned char seen[LM_COMBINATION_MAX];
  int i;
  int k;
  memset(seen, 0, sizeof seen);
  dealt = 0;
  dealt_combinations = 0;
  for (i = 0; i < count; i++) {
    for (k = 0; k < batch[i].parent_count; k++) {
      dealt++;
      dealt_combinations += !seen[batch[i].parent[k].combination]++;
    }
  }
}

/* Whether the population has this design. */
static int is_dealt(const lm_task batch[], int count, const lm_solution *found) {
  int i;
  int k;
  for (i = 0; i < count; i++) {
    for (k = 0; k < batch[i].parent_count; k++) {
      if (memcmp(&batch[i].parent[k], found, sizeof *found) == 0) {
        return 1;
      }
    }
  }
  return 0;
}

/* After count_dealt. */
static void count_ends_left_out(const lm_task batch[], int count) {
  static lm_solution front[FRONT_MAX];
  const int designs = lm_read_front(search, front, FRONT_MAX);
  int i;
  int j;
  int k;
  if (dealt < 2 * LM_PARENT_MAX || designs < dealt) {
    return;
  }
  recalls++;
  for (i = 0; i < designs; i++) {
    for (j = 0; j < problem.objective_count; j++) {
      for (k = 0; k < designs && (front[k].combination != front[i].combination ||
                                  front[k].objective[j] >= front[i].objective[j]);
           k++) {
      }
      ends_left_out += k == designs && !is_dealt(batch, count, &front[i]);
    }
  }
}

/* Runs the search to its end with an artificial model. */
static void run_in(const world *w, const char *spec) {
  lm_spec_error error = {0, ""};
  const lm_task *tasks;
  int next = 0;
  int count;
  TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(spec, &problem, &error), error.text);
  lm_close_search(search);
  search = lm_open_search(&problem);
  memset(kinds, 0, sizeof kinds);
  batches = 0;
  largest_batch = 0;
  ends_left_out = 0;
  recalls = 0;
  ends = 0;
  most_for_ends = 0;
  bred = 0;
  solved = 0;
  restarted = 0;
  into_front = 0;
  looks = 0;
  memset(&cheapest, 0, sizeof cheapest);
  while ((count = lm_next_tasks(search, &tasks)) > 0) {
    lm_task *batch = (lm_task *)malloc((size_t)count * sizeof *batch);
    int for_ends = 0;
    int for_looks = 0;
    int beside;
    int i;
    memcpy(batch, tasks, (size_t)count * sizeof *batch);
    batches++;
    largest_batch = count > largest_batch ? count : largest_batch;
    TEST_ASSERT_LESS_THAN_INT(20000, batches);
    beside = count_beside(batch, count);
    if (batch[0].kind == LM_TASK_EVOLVE) {
      count_dealt(batch, count);
      count_ends_left_out(batch, count);
    }
    for (i = 0; i < count; i++) {
      TEST_ASSERT_EQUAL_INT(next++, batch[i].id);
      check_task(&batch[i]);
      if (batch[i].kind == LM_TASK_EVOLVE) {
        bred += batch[i].budget;
      } else if (batch[0].kind == LM_TASK_EVOLVE && batch[i].kind == LM_TASK_EVALUATE) {
        looks++;
        for_looks += batch[i].budget;
      } else if (beside > 0 && i == count - 1 && beside % problem.objective_count == 1) {
        count_solver_task(&batch[i]);
      } else if (batch[0].kind == LM_TASK_EVOLVE) {
        count_end(&batch[i]);
        for_ends += batch[i].budget;
        solved += batch[i].budget;
      }
      make_up(w, &batch[i]);
      if (batch[i].kind == LM_TASK_REPAIR &&
          (cheapest.violation <= 0 || answer->value < cheapest.value)) {
        cheapest = *answer;
      }
      TEST_ASSERT_EQUAL_INT(LM_OK, lm_accept_answer(search, answer));
    }
    most_for_ends = for_ends > most_for_ends ? for_ends : most_for_ends;
    TEST_ASSERT_LESS_OR_EQUAL_INT(problem.evaluations / 20, for_looks);
    free(batch);
    check_books();
  }
  check_front();
}

static int stage(void) {
  lm_progress progress;
  lm_read_progress(search, &progress);
  return progress.stage;
}

/* A spec with so many objectives, evaluations and modules to choose from. */
static const char *spec_of(int objectives, int evaluations, int modules, int seed) {
  static const char *const names[] = {"tolerance_lost_motion", "cost", "stress", "compliance"};
  static char text[4096];
  int length;
  int i;
  length = snprintf(text, sizeof text,
                    "rated_torque_Nm 40\n"
                    "fixed generator.type discs\n"
                    "fixed teeth.face_width_mm 10\n"
                    "range teeth.flexspline_shift 2 4\n"
                    "range generator.deflection_modules 0.88 1.05\n"
                    "range teeth.engagement_depth 0.9 1.3\n"
                    "evaluations %d\nseed %d\n",
                    evaluations, seed);
  for (i = 0; i < objectives; i++) {
    length += snprintf(text + length, sizeof text - (size_t)length, "objective %s\n", names[i]);
  }
  length += snprintf(text + length, sizeof text - (size_t)length, "choose teeth.module_mm");
  for (i = 0; i < (modules < 40 ? modules : 40); i++) {
    length += snprintf(text + length, sizeof text - (size_t)length, " %g", 0.2 + 0.001 * i);
  }
  length +=
      snprintf(text + length, sizeof text - (size_t)length, "\nchoose teeth.flexspline_teeth");
  for (i = 0; i < (modules + 39) / 40; i++) {
    length += snprintf(text + length, sizeof text - (size_t)length, " %d", 150 + 2 * i);
  }
  (void)snprintf(text + length, sizeof text - (size_t)length, "\n");
  return text;
}

TEST(test_every_search_ends_with_its_budget_spent) {
  static const int budgets[] = {10, 100, 1000, 5000, 12000, 40000};
  int objectives;
  int seed;
  int i;
  for (objectives = 1; objectives <= 4; objectives++) {
    for (i = 0; i < 6; i++) {
      for (seed = 1; seed <= 3; seed++) {
        run_in(&plain, spec_of(objectives, budgets[i], 7, seed));
        TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, stage());
        TEST_ASSERT_LESS_OR_EQUAL_INT(budgets[i], used());
        TEST_ASSERT_GREATER_THAN_INT(0, kinds[LM_TASK_SCREEN]);
        TEST_ASSERT_GREATER_THAN_INT(0, kinds[LM_TASK_VERIFY]);
        TEST_ASSERT_EQUAL_INT(0, kinds[LM_TASK_REPAIR]); /* for a design was found */
      }
    }
  }
}

/* The stages that a larger budget opens. */
TEST(test_a_budget_goes_where_the_stages_say) {
  run_in(&plain, spec_of(1, 20000, 7, 1));
  TEST_ASSERT_GREATER_THAN_INT(0, kinds[LM_TASK_EVOLVE]);
  TEST_ASSERT_GREATER_THAN_INT(0, kinds[LM_TASK_ISRES]); /* restarts of one objective */
  run_in(&plain, spec_of(2, 20000, 7, 1));
  TEST_ASSERT_EQUAL_INT(0, kinds[LM_TASK_ISRES]);
  TEST_ASSERT_EQUAL_INT(0, kinds[LM_TASK_COBYLA]); /* the population and the solver have all */
  run_in(&plain, spec_of(3, 20000, 7, 1));
  TEST_ASSERT_EQUAL_INT(0, kinds[LM_TASK_ISRES]);
  TEST_ASSERT_GREATER_THAN_INT(0, kinds[LM_TASK_COBYLA]);
}

/* The population breeds from the extreme points of the front, if the budget is large enough to find
 * them. With two objectives or few evaluations it gets the rest, and they are sought again. */
TEST(test_the_ends_of_the_front_are_sought_beside_the_population) {
  world infeasible = plain;
  int objectives;
  for (objectives = 2; objectives <= 4; objectives++) {
    run_in(&plain, spec_of(objectives, 5000, 7, 1));
    TEST_ASSERT_EQUAL_INT(2 * objectives, ends);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(6 * objectives, looks); /* at each end, six combinations */
    TEST_ASSERT_TRUE(ends_from >= 1500 && ends_from < 2000);
    TEST_ASSERT_EQUAL_INT(0, kinds[LM_TASK_COBYLA]); /* no separate stage */
    TEST_ASSERT_TRUE(used() > 4900);
    run_in(&plain, spec_of(objectives, 40000, 7, 1));
    TEST_ASSERT_EQUAL_INT(objectives == 2 ? 4 : objectives, ends);
    TEST_ASSERT_EQUAL_INT(objectives > 2, kinds[LM_TASK_COBYLA] > 0);
  }
  run_in(&plain, spec_of(1, 5000, 7, 1));
  TEST_ASSERT_EQUAL_INT(0, ends);
  infeasible.feasible = 0; /* there is no front */
  run_in(&infeasible, spec_of(2, 5000, 7, 1));
  TEST_ASSERT_EQUAL_INT(0, ends);
}

/* A tenth of the budget, but a gradient for each, and no more than a solver uses. */
TEST(test_the_ends_of_the_front_leave_the_budget_to_what_lies_between) {
  char many[4096];
  run_in(&plain, spec_of(4, 5000, 7, 1));
  TEST_ASSERT_INT_WITHIN(4, 500, most_for_ends);
  run_in(&plain, spec_of(4, 40000, 7, 1));
  TEST_ASSERT_EQUAL_INT(4 * 30 * lm_slope_charge(&problem), most_for_ends);
  (void)snprintf(many, sizeof many, "%s%s", spec_of(4, 620, 7, 1),
                 "range teeth.shift_difference -0.3 0.3\nrange teeth.tooth_height 1.4 2\n"
                 "range teeth.root_clearance 0.25 0.4\nrange teeth.pressure_angle_deg 20 25\n"
                 "range flexspline.rim_thickness_mm 0.45 0.8\nrange flexspline.length_mm 20 30\n");
  run_in(&plain, many);
  TEST_ASSERT_EQUAL_INT(4 * lm_slope_charge(&problem), most_for_ends);
  run_in(&plain, spec_of(2, 40000, 7, 1));
  TEST_ASSERT_EQUAL_INT(2 * 30 * lm_slope_charge(&problem), most_for_ends);
}

/* Each in another combination, so that there are more ends than places in the population. */
TEST(test_a_front_of_many_combinations_is_recalled_in_part) {
  run_in(&plain, spec_of(4, 9000, 1200, 1));
  TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, stage());
  TEST_ASSERT_EQUAL_INT(2 * LM_PARENT_MAX, dealt);
  TEST_ASSERT_GREATER_THAN_INT(LM_PARENT_MAX, dealt_combinations);
}

/* The best design of each combination in each objective is the first that a population loses. */
TEST(test_a_population_breeds_from_the_ends_of_the_front) {
  int objectives;
  for (objectives = 3; objectives <= 4; objectives++) {
    run_in(&plain, spec_of(objectives, 9000, 4, 1));
    TEST_ASSERT_GREATER_THAN_INT(0, recalls);
    TEST_ASSERT_EQUAL_INT(0, ends_left_out);
  }
}

/* A front that is wide after the screening, of fewer combinations than half the places of a
 * population. */
TEST(test_a_wide_front_of_few_combinations_fills_the_population) {
  run_in(&plain, spec_of(4, 9000, 20, 1));
  TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, stage());
  TEST_ASSERT_EQUAL_INT(2 * LM_PARENT_MAX, dealt);
}

/* A quarter of the evaluations of the population: a generation adds at most both ends and one task
 * more. Those go into the front in turn. */
TEST(test_a_solver_works_beside_the_population_of_two_objectives) {
  static const int budgets[] = {5000, 12000, 40000};
  int i;
  for (i = 0; i < 3; i++) {
    int most;
    run_in(&plain, spec_of(2, budgets[i], 7, 1));
    most = 3 * 40 * lm_slope_charge(&problem);
    TEST_ASSERT_TRUE(solved >= bred / 4 - most / 3 && solved <= bred / 4 + most);
    TEST_ASSERT_GREATER_THAN_INT(0, into_front);
    TEST_ASSERT_TRUE(restarted == into_front || restarted == into_front + 1);
  }
  run_in(&plain, spec_of(3, 5000, 7, 1));
  TEST_ASSERT_EQUAL_INT(0, restarted + into_front);
}

TEST(test_a_model_that_refuses_everything_ends_the_search) {
  world refusing = plain;
  lm_progress progress;
  double unit[LM_FREE_MAX];
  double violation;
  int combination;
  int objectives;
  refusing.computed = 0;
  for (objectives = 1; objectives <= 2; objectives++) {
    run_in(&refusing, spec_of(objectives, 3000, 7, 1));
    lm_read_progress(search, &progress);
    TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, progress.stage);
    TEST_ASSERT_EQUAL_INT(0, progress.front_size);
    TEST_ASSERT_EQUAL_INT(7, progress.fate[LM_FATE_NOT_REACHED]);
    TEST_ASSERT_GREATER_THAN_INT(0, progress.refused);
    TEST_ASSERT_EQUAL_INT(0, lm_read_nearest(search, &combination, unit, &violation));
  }
}

TEST(test_without_a_feasible_design_restarts_go_on_and_the_nearest_is_told) {
  world infeasible = plain;
  double unit[LM_FREE_MAX];
  double violation = -1;
  int combination;
  int objectives;
  infeasible.feasible = 0;
  for (objectives = 1; objectives <= 3; objectives++) {
    run_in(&infeasible, spec_of(objectives, 12000, 7, 1));
    TEST_ASSERT_EQUAL_INT(0, lm_read_front(search, NULL, 0));
    TEST_ASSERT_EQUAL_INT(1, lm_read_nearest(search, &combination, unit, &violation));
    TEST_ASSERT_TRUE(violation == cheapest.violation);
    TEST_ASSERT_EQUAL_INT(cheapest.combination, combination);
    TEST_ASSERT_EQUAL_MEMORY(cheapest.unit, unit, sizeof unit);
    TEST_ASSERT_EQUAL_INT(0, kinds[LM_TASK_VERIFY]);
    TEST_ASSERT_EQUAL_INT(8, kinds[LM_TASK_REPAIR]);
  }
}

/* One objective: rounds without anything better end the search before its budget. */
/* All of the front is checked, and the best of each objective solved; if no design is within the
 * limits, neighbours are tried, and the search ends. */
TEST(test_a_front_of_which_nothing_holds_is_tried_beside) {
  static lm_solution front[FRONT_MAX];
  world unsure = plain;
  int objectives;
  for (objectives = 1; objectives <= 3; objectives++) {
    int settled;
    run_in(&plain, spec_of(objectives, 5000, 7, 1));
    settled = kinds[LM_TASK_VERIFY];
    TEST_ASSERT_GREATER_OR_EQUAL_INT(objectives, settled);
    TEST_ASSERT_GREATER_THAN_INT(0, kinds[LM_TASK_CONFIRM]);
    TEST_ASSERT_EQUAL_INT(0, kinds[LM_TASK_ROUND]); /* no grades here */
    TEST_ASSERT_EQUAL_INT(1, lm_read_front(search, front, FRONT_MAX) > 0 && front[0].verified);
    unsure.nothing_holds = 1;
    run_in(&unsure, spec_of(objectives, 5000, 7, 1));
    TEST_ASSERT_GREATER_THAN_INT(settled, kinds[LM_TASK_VERIFY]);
    TEST_ASSERT_EQUAL_INT(1, lm_read_front(search, front, FRONT_MAX) > 0 && !front[0].verified);
  }
}

TEST(test_restarts_that_find_nothing_better_end_early) {
  world same = plain;
  same.single = 1;
  run_in(&same, spec_of(1, 200000, 7, 1));
  TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, stage());
  TEST_ASSERT_LESS_THAN_INT(195000, used());
  TEST_ASSERT_EQUAL_INT(1, lm_read_front(search, NULL, 0));
}

TEST(test_fronts_of_one_design_and_flat_objectives_are_no_trouble) {
  world same = plain;
  world flat = plain;
  int objectives;
  same.single = 1;
  flat.flat = 1;
  for (objectives = 1; objectives <= 4; objectives++) {
    run_in(&same, spec_of(objectives, 15000, 7, 1));
    TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, stage());
    run_in(&flat, spec_of(objectives, 15000, 7, 1));
    TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, stage());
    TEST_ASSERT_EQUAL_INT(1, lm_read_front(search, NULL, 0));
  }
}

/* More combinations than a batch holds, and than a small budget can evaluate. */
TEST(test_many_combinations_are_screened_in_batches) {
  lm_progress progress;
  run_in(&plain, spec_of(2, 20000, 1200, 1));
  TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, stage());
  TEST_ASSERT_EQUAL_INT(256, largest_batch);
  run_in(&plain, spec_of(2, 500, 1200, 1));
  lm_read_progress(search, &progress);
  TEST_ASSERT_GREATER_THAN_INT(900, progress.fate[LM_FATE_NOT_REACHED]);
}

/* A race of all of them: 256 at a time. Tasks that cost 500 times their budget make it short. */
TEST(test_a_race_of_many_fits_the_batch) {
  world dear = plain;
  lm_progress progress;
  dear.overrun = 500;
  run_in(&dear, spec_of(3, 50000000, 400, 1));
  lm_read_progress(search, &progress);
  TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, progress.stage);
  TEST_ASSERT_EQUAL_INT(256, largest_batch);
  TEST_ASSERT_GREATER_THAN_INT(256, kinds[LM_TASK_SLSQP]);
}

/* More members than requested, and than the islands hold. */
TEST(test_members_beyond_the_islands_are_let_go) {
  world crowded = plain;
  crowded.from_members = LM_PARENT_MAX;
  run_in(&crowded, spec_of(2, 12000, 40, 1));
  TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, stage());
}

/* An excluded combination remains excluded, even if a population has points of it: they state how
 * far the limit is from being met. */
TEST(test_pruned_combinations_stay_pruned) {
  world infeasible = plain;
  char spec[4096];
  lm_spec_error error = {0, ""};
  lm_progress progress;
  double unit[LM_FREE_MAX];
  double violation;
  int combination;
  infeasible.feasible = 0;
  snprintf(spec, sizeof spec, "%slimit outer_diameter_max_mm 10\n", spec_of(2, 3000, 7, 1));
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_read_spec(spec, &problem, &error));
  search = lm_open_search(&problem);
  lm_read_progress(search, &progress);
  TEST_ASSERT_EQUAL_INT(7, progress.fate[LM_FATE_PRUNED]);
  TEST_ASSERT_TRUE(progress.feasible_share == 0);
  run_in(&infeasible, spec);
  lm_read_progress(search, &progress);
  TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, progress.stage);
  TEST_ASSERT_EQUAL_INT(7, progress.fate[LM_FATE_PRUNED]);
  TEST_ASSERT_EQUAL_INT(kinds[LM_TASK_EVOLVE], progress.tasks_done);
  TEST_ASSERT_EQUAL_INT(1, lm_read_nearest(search, &combination, unit, &violation));
}

/* Answers every batch of a search until a population is requested; its number of parents. */
static int deal_first_population(void) {
  const lm_task *tasks;
  int count = lm_next_tasks(search, &tasks);
  while (tasks[0].kind != LM_TASK_EVOLVE) {
    lm_task *batch = (lm_task *)malloc((size_t)count * sizeof *batch);
    int i;
    memcpy(batch, tasks, (size_t)count * sizeof *batch);
    for (i = 0; i < count; i++) {
      make_up(&plain, &batch[i]);
      TEST_ASSERT_EQUAL_INT(LM_OK, lm_accept_answer(search, answer));
    }
    free(batch);
    count = lm_next_tasks(search, &tasks);
    TEST_ASSERT_GREATER_THAN_INT(0, count);
  }
  count_dealt(tasks, count);
  return dealt;
}

/* Designs to begin with are examined before anything else, and the first population breeds from
 * those on the front. */
TEST(test_a_search_begins_with_its_starts) {
  static const int budgets[] = {5000, 40000};
  lm_spec_error error = {0, ""};
  char spec[4096];
  int i;
  for (i = 0; i < 2; i++) {
    const lm_task *tasks;
    int parents;
    lm_close_search(search);
    TEST_ASSERT_EQUAL_INT(LM_OK, lm_read_spec(spec_of(3, budgets[i], 7, 1), &problem, &error));
    search = lm_open_search(&problem);
    parents = deal_first_population();
    TEST_ASSERT_LESS_OR_EQUAL_INT(7, parents);
    snprintf(spec, sizeof spec, "%sstart 0.203 150 2.5 0.88 1.3\nstart 0.2 150 4 0.965 1\n",
             spec_of(3, budgets[i], 7, 1));
    TEST_ASSERT_EQUAL_INT_MESSAGE(LM_OK, lm_read_spec(spec, &problem, &error), error.text);
    lm_close_search(search);
    search = lm_open_search(&problem);
    TEST_ASSERT_EQUAL_INT(2, lm_next_tasks(search, &tasks));
    TEST_ASSERT_EQUAL_INT(LM_TASK_EVALUATE, tasks[0].kind);
    TEST_ASSERT_EQUAL_INT(3, tasks[0].combination);
    TEST_ASSERT_TRUE(tasks[0].unit[0] == 0.25 && tasks[0].unit[1] == 0 && tasks[0].unit[2] == 1);
    TEST_ASSERT_EQUAL_INT(0, tasks[1].combination);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, tasks[1].unit[1]);
    TEST_ASSERT_GREATER_THAN_INT(7, deal_first_population());
    run_in(&plain, spec);
    TEST_ASSERT_EQUAL_INT(2, kinds[LM_TASK_EVALUATE] - looks);
    TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, stage());
    TEST_ASSERT_LESS_OR_EQUAL_INT(budgets[i], used());
  }
}

TEST(test_a_start_that_a_bound_excludes_is_left_out) {
  world infeasible = plain;
  char spec[4096];
  infeasible.feasible = 0;
  snprintf(spec, sizeof spec, "%slimit outer_diameter_max_mm 10\nstart 0.203 150 2.5 0.88 1.3\n",
           spec_of(2, 3000, 7, 1));
  run_in(&infeasible, spec);
  TEST_ASSERT_EQUAL_INT(0, kinds[LM_TASK_EVALUATE]);
  TEST_ASSERT_EQUAL_INT(LM_STAGE_DONE, stage());
}

TEST(test_ids_and_fates_outside_are_refused) {
  lm_spec_error error = {0, ""};
  const lm_task *tasks;
  lm_answer *repeated = (lm_answer *)malloc(sizeof *repeated);
  int count;
  int i;
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_read_spec(spec_of(2, 1000, 7, 1), &problem, &error));
  search = lm_open_search(&problem);
  count = lm_next_tasks(search, &tasks);
  make_up(&plain, &tasks[0]);
  answer->combination = tasks[0].combination + 1;
  TEST_ASSERT_EQUAL_INT(LM_OUT_OF_RANGE, lm_accept_answer(search, answer));
  answer->combination = tasks[0].combination;
  TEST_ASSERT_EQUAL_INT(LM_NULL, lm_accept_answer(NULL, answer));
  TEST_ASSERT_EQUAL_INT(0, lm_is_answered(search, tasks[0].id));
  TEST_ASSERT_EQUAL_INT(0, lm_is_answered(search, count));
  *repeated = *answer;
  for (i = 0; i < count; i++) {
    const lm_task task = tasks[i];
    make_up(&plain, &task);
    TEST_ASSERT_EQUAL_INT(LM_OK, lm_accept_answer(search, answer));
  }
  /* an answer of a finished batch */
  TEST_ASSERT_EQUAL_INT(1, lm_is_answered(search, repeated->id));
  TEST_ASSERT_EQUAL_INT(LM_OK, lm_accept_answer(search, repeated));
  TEST_ASSERT_EQUAL_STRING("", lm_fate_name(-1));
  TEST_ASSERT_EQUAL_STRING("", lm_fate_name(LM_FATE_COUNT));
  free(repeated);
  lm_close_search(NULL);
}
