#include "archive.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Resolution of an objective, in its unit. Every difference adds a design to a front, and below
 * this a difference is rounding: kinematic errors of 1e-12 arcsec are equal. */
#define RESOLUTION 1e-9

uint64_t lm_mix(uint64_t x) {
  x += UINT64_C(0x9e3779b97f4a7c15);
  x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
  x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
  return x ^ (x >> 31);
}

void lm_fill_solution(const lm_problem *problem, lm_solution *found, int combination,
                      const double unit[], const double objective[], double violation) {
  int j;
  memset(found, 0, sizeof *found);
  found->combination = combination;
  found->violation = violation;
  memcpy(found->unit, unit, (size_t)problem->range_count * sizeof unit[0]);
  for (j = 0; j < problem->objective_count; j++) {
    found->objective[j] = round(objective[j] / RESOLUTION) * RESOLUTION;
  }
}

/* Whether the first one of two designs is better in any objective (1), and whether the second one
 * is (2). Without branches, because the objective that separates two designs is not predictable. */
static int better_ones(const lm_problem *problem, const double a[], const double b[]) {
  int first = 0;
  int second = 0;
  int j;
  for (j = 0; j < problem->objective_count; j++) {
    first |= a[j] < b[j];
    second |= b[j] < a[j];
  }
  return first + 2 * second;
}

int lm_is_as_good(const lm_problem *problem, const double a[], const double b[]) {
  return better_ones(problem, a, b) < 2;
}

/* Distance between two designs in shares of their objectives. */
static double distance(const lm_problem *problem, const double a[], const double b[]) {
  double sum = 0;
  int j;
  for (j = 0; j < problem->objective_count; j++) {
    sum += fabs(a[j] - b[j]) / (fabs(a[j]) + fabs(b[j]) + 1e-12);
  }
  return sum;
}

/* In longer lists the best designs of each objective are a small part. */
#define ENDS_SHARE 8

/* Place of the design that a full list drops. If the ends were not kept, each design close to an
 * end would replace it, and the front would shrink from there. */
static int choose_place(const lm_problem *problem, const lm_solution list[], int count,
                        const lm_solution *found) {
  int end[LM_OBJECTIVE_MAX] = {0};
  double nearest = HUGE_VAL;
  int place = 0;
  int i;
  int j;
  for (i = 1; i < count; i++) {
    for (j = 0; j < problem->objective_count; j++) {
      end[j] = list[i].objective[j] < list[end[j]].objective[j] ? i : end[j];
    }
  }
  for (i = 0; i < count; i++) {
    const double apart = distance(problem, list[i].objective, found->objective);
    int stays = 0;
    for (j = 0; j < problem->objective_count; j++) {
      stays |= end[j] == i && count > ENDS_SHARE * problem->objective_count;
    }
    if (apart < nearest && !stays) {
      nearest = apart;
      place = i;
    }
  }
  return place;
}

int lm_insert_solution(const lm_problem *problem, lm_solution list[], int *count, int capacity,
                       const lm_solution *found) {
  int kept = 0;
  int i;
  /* No design of the list is as good as another one: a design that dominates one of them is
   * dominated by none, so nothing has moved yet if the new one is rejected. */
  for (i = 0; i < *count; i++) {
    const int better = better_ones(problem, list[i].objective, found->objective);
    if (better < 2) {
      return 0;
    }
    if (better & 1) {
      if (kept < i) {
        list[kept] = list[i];
      }
      kept++;
    }
  }
  *count = kept < capacity ? kept + 1 : kept;
  list[kept < capacity ? kept : choose_place(problem, list, kept, found)] = *found;
  return 1;
}

static int in_order(const void *a, const void *b) {
  const lm_solution *x = (const lm_solution *)a;
  const lm_solution *y = (const lm_solution *)b;
  int i;
  for (i = 0; i < LM_OBJECTIVE_MAX; i++) {
    if (x->objective[i] != y->objective[i]) {
      return x->objective[i] > y->objective[i] ? 1 : -1;
    }
  }
  if (x->combination != y->combination) {
    return x->combination > y->combination ? 1 : -1;
  }
  return memcmp(x->unit, y->unit, sizeof x->unit);
}

void lm_sort_solutions(lm_solution list[], int count) {
  qsort(list, (size_t)count, sizeof list[0], in_order);
}

/* --- selection -------------------------------------------------------------------------------- */

/* Which of two designs is better, 1 or 2, else another number: feasible before infeasible,
 * less violation before more, then by the objectives. */
static int better_found(const lm_problem *problem, const lm_solution *a, const lm_solution *b) {
  if (a->violation <= 0 && b->violation <= 0) {
    return better_ones(problem, a->objective, b->objective);
  }
  if (a->violation <= 0 || b->violation <= 0) {
    return a->violation <= 0 ? 1 : 2;
  }
  return (a->violation < b->violation) + 2 * (b->violation < a->violation);
}

/* Marks the dominated designs of list[first .. count - 1]. Domination is transitive, so dominated
 * designs need not be compared further. */
static void mark_beaten(const lm_problem *problem, const lm_solution list[], int first, int count,
                        double beaten[]) {
  int i;
  int k;
  for (i = first; i < count; i++) {
    beaten[i] = 0;
  }
  for (i = first; i < count; i++) {
    for (k = i + 1; k < count && beaten[i] == 0; k++) {
      if (beaten[k] == 0) {
        const int better = better_found(problem, &list[i], &list[k]);
        beaten[i] = better == 2;
        beaten[k] = better == 1;
      }
    }
  }
}

/* Crowding distance within list[first .. last - 1]: for each objective, the width between both
 * neighbours in shares of the front's; ends count as infinitely far. */
static void crowd(const lm_problem *problem, const lm_solution list[], int first, int last,
                  double crowding[]) {
  int order[LM_POPULATION_MAX];
  int i;
  int j;
  for (i = first; i < last; i++) {
    crowding[i] = 0;
  }
  for (j = 0; j < problem->objective_count; j++) {
    double width;
    for (i = first; i < last; i++) {
      int k = i - first;
      while (k > 0 && list[order[k - 1]].objective[j] > list[i].objective[j]) {
        order[k] = order[k - 1];
        k--;
      }
      order[k] = i;
    }
    width = list[order[last - first - 1]].objective[j] - list[order[0]].objective[j];
    crowding[order[0]] = HUGE_VAL;
    crowding[order[last - first - 1]] = HUGE_VAL;
    for (i = 1; i < last - first - 1 && width > 0; i++) {
      crowding[order[i]] +=
          (list[order[i + 1]].objective[j] - list[order[i - 1]].objective[j]) / width;
    }
  }
}

static void swap_found(lm_solution list[], double crowding[], int a, int b) {
  const lm_solution moved = list[a];
  const double distance_moved = crowding[a];
  list[a] = list[b];
  list[b] = moved;
  crowding[a] = crowding[b];
  crowding[b] = distance_moved;
}

void lm_select_solutions(const lm_problem *problem, lm_solution list[], int count, int wanted) {
  double crowding[LM_POPULATION_MAX] = {0};
  int first = 0;
  int i;
  int k;
  lm_sort_solutions(list, count);
  /* Copies of a design would crowd out the others. */
  k = 0;
  for (i = 0; i < count; i++) {
    if (k == 0 || in_order(&list[k - 1], &list[i]) != 0) {
      swap_found(list, crowding, k++, i);
    }
  }
  count = k;
  while (first < count && first < wanted) {
    int last = first;
    mark_beaten(problem, list, first, count, crowding);
    for (i = first; i < count; i++) {
      if (crowding[i] == 0) {
        swap_found(list, crowding, last++, i);
      }
    }
    crowd(problem, list, first, last, crowding);
    for (i = first + 1; i < last; i++) {
      for (k = i; k > first && crowding[k] > crowding[k - 1]; k--) {
        swap_found(list, crowding, k, k - 1);
      }
    }
    first = last;
  }
}
