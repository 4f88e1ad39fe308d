#include "spec.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "decimal.h"
#include "lostmotion/design_keys.h"
#include "lostmotion/tolerance.h"

#define WORDS_MAX (LM_CHOICE_VALUES_MAX + 2)
#define LINE_MAX_CHARACTERS 2048

/* A line, split into words. */
typedef struct statement {
  char line[LINE_MAX_CHARACTERS];
  char *word[WORDS_MAX];
  int count;
  int cut; /* 1: the line has more than that */
} statement;

#define COUNT(array) ((int)(sizeof(array) / sizeof((array)[0])))

uint64_t lm_hash_text(const char *text) {
  uint64_t hash = UINT64_C(0xcbf29ce484222325);
  for (; *text != '\0'; text++) {
    hash = (hash ^ (unsigned char)*text) * UINT64_C(0x100000001b3);
  }
  return hash;
}

static lm_status complain(lm_spec_error *error, int line, const char *what, const char *word) {
  error->line = line;
  snprintf(error->text, sizeof error->text, "%s: \"%.60s\"", what, word);
  return LM_CORRUPT;
}

static const char *level_name(int level) {
  static const char *const names[] = {"worst", "probable", "quantile"};
  return level < COUNT(names) ? names[level] : "";
}

/* Index of a word among the names of an enumeration, which end with "", or -1. */
static int find_name(const char *word, const char *(*name_of)(int)) {
  int i;
  for (i = 0; *name_of(i) != '\0'; i++) {
    if (strcmp(word, name_of(i)) == 0) {
      return i;
    }
  }
  return -1;
}

/* A number, or a name of a drive file that represents one. */
static int read_number(const char *word, double *value) {
  int name = find_name(word, lm_generator_name);
  if (name < 0) {
    name = find_name(word, lm_deformation_name);
  }
  if (name < 0) {
    name = find_name(word, lm_flank_name);
  }
  if (name >= 0) {
    *value = name;
    return 1;
  }
  return lm_read_decimal(word, value);
}

/* Cut a line into words; returns the next line or null. */
static const char *read_line(const char *text, statement *s) {
  const char *end = strchr(text, '\n');
  size_t length = end != NULL ? (size_t)(end - text) : strlen(text);
  char *at;
  s->cut = length >= sizeof s->line;
  if (s->cut) {
    length = sizeof s->line - 1;
  }
  memcpy(s->line, text, length);
  s->line[length] = '\0';
  at = strchr(s->line, '#');
  if (at != NULL) {
    *at = '\0';
  }
  s->count = 0;
  at = s->line;
  for (;;) {
    at += strspn(at, " \t\r");
    s->cut |= *at != '\0' && s->count == WORDS_MAX;
    if (*at == '\0' || s->cut) {
      break;
    }
    s->word[s->count++] = at;
    at += strcspn(at, " \t\r");
    if (*at != '\0') {
      *at++ = '\0';
    }
  }
  return end != NULL ? end + 1 : NULL;
}

/* Statements of one number. */
static double *single_number(lm_problem *p, const char *word) {
  if (strcmp(word, "rated_torque_Nm") == 0) {
    return &p->rated_torque_Nm;
  }
  if (strcmp(word, "torque_Nm") == 0) {
    return &p->torque_Nm;
  }
  if (strcmp(word, "ratio_sign") == 0) {
    return &p->ratio_sign;
  }
  if (strcmp(word, "damaged_share") == 0) {
    return &p->damaged_share;
  }
  return NULL;
}

static int *single_integer(lm_problem *p, const char *word) {
  if (strcmp(word, "evaluations") == 0) {
    return &p->evaluations;
  }
  if (strcmp(word, "phases") == 0) {
    return &p->phases;
  }
  if (strcmp(word, "rigid_gear_turns") == 0) {
    return &p->rigid_gear_turns;
  }
  return NULL;
}

/* 0: a different number of values, or no room. */
static int add_variable(lm_problem *p, const char *kind, int key, const double value[], int count) {
  if (strcmp(kind, "fixed") == 0) {
    p->value[key] = value[0];
    return count == 1;
  }
  if (strcmp(kind, "choose") == 0) {
    lm_choice *choice = &p->choice[p->choice_count];
    if (count == 0 || p->choice_count == LM_CHOICE_MAX) {
      return 0;
    }
    choice->key = key;
    choice->count = count;
    memcpy(choice->value, value, (size_t)count * sizeof value[0]);
    p->choice_count++;
  } else {
    lm_range *range = &p->range[p->range_count];
    if (count != 2 || p->range_count == LM_FREE_MAX) {
      return 0;
    }
    range->key = key;
    range->whole = strcmp(kind, "whole") == 0;
    range->low = value[0];
    range->high = value[1];
    p->range_count++;
  }
  return 1;
}

static lm_status read_variable(const statement *s, lm_problem *p, int line, lm_spec_error *error) {
  const int key = lm_find_key(s->word[1]);
  double value[WORDS_MAX] = {0};
  int i;
  if (key < 0) {
    return complain(error, line, "unknown key", s->word[1]);
  }
  if (p->given[key] || p->given[lm_rival_key(key)]) {
    return complain(error, line, "a second value of a key", s->word[1]);
  }
  for (i = 2; i < s->count; i++) {
    if (!read_number(s->word[i], &value[i])) {
      return complain(error, line, "expected a number", s->word[i]);
    }
  }
  if (!add_variable(p, s->word[0], key, value + 2, s->count - 2)) {
    return complain(error, line, "wrong number of values, or too many variables", s->word[1]);
  }
  p->given[key] = 1;
  return LM_OK;
}

static lm_status read_limit(const statement *s, lm_problem *p, int line, lm_spec_error *error) {
  lm_bounds *b = &p->bounds;
  double value = 0;
  int limit;
  if (s->count != 3 || !read_number(s->word[2], &value)) {
    return complain(error, line, "expected one number after the limit", s->word[1]);
  }
  if (strcmp(s->word[1], "free_assembly") == 0) {
    b->free_assembly = value != 0;
    return LM_OK;
  }
  if (strcmp(s->word[1], "gap_at_worst_corner") == 0) {
    b->gap_at_worst_corner = value != 0;
    return LM_OK;
  }
  for (limit = LM_LIMIT_SAFETY; limit < LM_LIMIT_COUNT; limit++) {
    if (strcmp(s->word[1], lm_limit_name(limit)) == 0) {
      break;
    }
  }
  switch (limit) {
    case LM_LIMIT_SAFETY:
      b->safety_factor_min = value;
      break;
    case LM_LIMIT_OUTER_DIAMETER:
      b->outer_diameter_max_mm = value;
      break;
    case LM_LIMIT_INTERFERENCE:
      b->interference_max_mm = value;
      break;
    case LM_LIMIT_GAP:
      b->gap_min_arcmin = value;
      break;
    case LM_LIMIT_COUNT:
      return complain(error, line, "unknown limit", s->word[1]);
    default:
      /* A stiffness in N m/rad is a largest compliance in arcmin per N m. */
      b->figure_max[limit - LM_LIMIT_FIGURE] =
          limit == (int)LM_LIMIT_FIGURE + (int)LM_FIGURE_COMPLIANCE && value > 0
              ? 10800.0 / LM_PI / value
              : value;
      break;
  }
  return LM_OK;
}

static lm_status read_link(const statement *s, lm_problem *p, int line, lm_spec_error *error) {
  lm_graded_link *link = &p->link[p->link_count < LM_LINK_MAX ? p->link_count : 0];
  double value[5];
  int i;
  if (s->count != 8 || p->link_count == LM_LINK_MAX) {
    return complain(error, line, "expected 7 values, or too many links", s->word[0]);
  }
  for (i = 0; i < 5; i++) {
    if (!read_number(s->word[i + 1], &value[i])) {
      return complain(error, line, "expected a number", s->word[i + 1]);
    }
  }
  link->influence = value[0];
  link->diameter_mm = value[1];
  link->position = value[2];
  link->offset_mm = value[3];
  link->cost_weight = value[4];
  link->distribution = find_name(s->word[6], lm_distribution_name);
  link->zone = find_name(s->word[7], lm_zone_name);
  if (link->distribution < 0) {
    return complain(error, line, "unknown distribution", s->word[6]);
  }
  if (link->zone < 0) {
    return complain(error, line, "unknown zone", s->word[7]);
  }
  p->link_count++;
  return LM_OK;
}

/* `columns` numbers of a chain member. */
static lm_status read_member(const statement *s, double *member, int columns, int *count, int line,
                             lm_spec_error *error) {
  int i;
  if (s->count != columns + 1 || *count == LM_CHAIN_MAX) {
    return complain(error, line, "wrong number of values, or too many members", s->word[0]);
  }
  for (i = 0; i < columns; i++) {
    if (!read_number(s->word[i + 1], &member[*count * columns + i])) {
      return complain(error, line, "expected a number", s->word[i + 1]);
    }
  }
  (*count)++;
  return LM_OK;
}

static lm_status read_cost(const statement *s, lm_problem *p, int line, lm_spec_error *error) {
  double value = 0;
  int type;
  if (s->count != 3 || !read_number(s->word[2], &value)) {
    return complain(error, line, "expected one number after the coefficient", s->word[1]);
  }
  type = find_name(s->word[1], lm_generator_name);
  if (strcmp(s->word[1], "tolerance_exponent") == 0) {
    p->cost.tolerance_exponent = value;
  } else if (strcmp(s->word[1], "size") == 0) {
    p->cost.size = value;
  } else if (type >= 0) {
    p->cost.generator[type] = value;
  } else {
    return complain(error, line, "unknown coefficient of cost", s->word[1]);
  }
  return LM_OK;
}

static lm_status read_ratio(const statement *s, lm_problem *p, int line, lm_spec_error *error) {
  double low = 0;
  double high = 0;
  if (p->given[LM_KEY_FLEXSPLINE_TEETH]) {
    return complain(error, line, "a second value of teeth.flexspline_teeth", s->word[0]);
  }
  if (s->count != 3 || !read_number(s->word[1], &low) || !read_number(s->word[2], &high) ||
      lm_choose_teeth_by_ratio(p, low, high, NULL) != LM_OK) {
    return complain(error, line, "expected a lowest and a highest ratio that teeth can give",
                    s->word[0]);
  }
  p->given[LM_KEY_FLEXSPLINE_TEETH] = 1;
  return LM_OK;
}

/* Tolerance for rounding of a value beyond an end of its range. */
#define ROUNDING 1e-9

/* Place of a value in a choice, or -1. */
static int find_choice(const lm_choice *choice, double value) {
  int i;
  for (i = 0; i < choice->count; i++) {
    if (choice->value[i] == value) {
      return i;
    }
  }
  return -1;
}

static lm_status read_start(const statement *s, lm_problem *p, int line, lm_spec_error *error) {
  lm_start *start = &p->start[p->start_count < LM_START_MAX ? p->start_count : 0];
  int factor = 1;
  int i;
  if (s->count != 1 + p->choice_count + p->range_count || p->start_count == LM_START_MAX) {
    return complain(error, line, "expected a value of every variable, or too many starts",
                    s->word[0]);
  }
  start->combination = 0;
  for (i = 0; i < p->choice_count + p->range_count; i++) {
    const char *word = s->word[1 + i];
    double value = 0;
    if (!read_number(word, &value)) {
      return complain(error, line, "expected a number", word);
    }
    if (i < p->choice_count) {
      const int place = find_choice(&p->choice[i], value);
      if (place < 0) {
        return complain(error, line, "a start that is none of the choices", word);
      }
      start->combination += factor * place;
      factor *= p->choice[i].count;
    } else {
      const lm_range *range = &p->range[i - p->choice_count];
      const double unit = (value - range->low) / (range->high - range->low);
      if (!(unit >= -ROUNDING && unit <= 1 + ROUNDING)) {
        return complain(error, line, "a start outside its range", word);
      }
      start->unit[i - p->choice_count] = lm_clip(unit);
    }
  }
  p->start_count++;
  return LM_OK;
}

static lm_status read_single(const statement *s, lm_problem *p, int line, lm_spec_error *error) {
  const char *word = s->word[0];
  double *number = single_number(p, word);
  int *integer = single_integer(p, word);
  const int seed = strcmp(word, "seed") == 0;
  double value = 0;
  if (!seed && number == NULL && integer == NULL) {
    return complain(error, line, "unknown statement", word);
  }
  if (!read_number(s->word[1], &value)) {
    return complain(error, line, "expected a number", s->word[1]);
  }
  if (number != NULL) {
    *number = value;
    return LM_OK;
  }
  if (!(value >= 0 && value <= (seed ? 4294967295.0 : 2147483647.0)) || floor(value) < value) {
    return complain(error, line, "expected a whole number, not too large", s->word[1]);
  }
  if (seed) {
    p->seed = (unsigned int)value;
  } else {
    *integer = (int)value;
  }
  return LM_OK;
}

static lm_status read_statement(const statement *s, lm_problem *p, int line, lm_spec_error *error) {
  const char *word = s->word[0];
  int name;
  if (strcmp(word, "start") == 0) {
    return read_start(s, p, line, error);
  }
  if (p->start_count > 0) {
    return complain(error, line, "expected no other statement after a start", word);
  }
  if (strcmp(word, "link") == 0) {
    return read_link(s, p, line, error);
  }
  if (strcmp(word, "radial") == 0) {
    return read_member(s, &p->radial[0][0], 4, &p->radial_count, line, error);
  }
  if (strcmp(word, "torsion") == 0) {
    return read_member(s, &p->torsion[0][0], 2, &p->torsion_count, line, error);
  }
  if (strcmp(word, "ratio") == 0) {
    return read_ratio(s, p, line, error);
  }
  if (s->count < 2) {
    return complain(error, line, "expected a value", word);
  }
  if (strcmp(word, "fixed") == 0 || strcmp(word, "range") == 0 || strcmp(word, "whole") == 0 ||
      strcmp(word, "choose") == 0) {
    return read_variable(s, p, line, error);
  }
  if (strcmp(word, "limit") == 0) {
    return read_limit(s, p, line, error);
  }
  if (strcmp(word, "cost") == 0) {
    return read_cost(s, p, line, error);
  }
  if (strcmp(word, "objective") == 0) {
    name = lm_find_figure(s->word[1]);
    if (name < 0 || p->objective_count == LM_OBJECTIVE_MAX) {
      return complain(error, line, "unknown objective, or more than four", s->word[1]);
    }
    p->objective[p->objective_count++] = name;
    return LM_OK;
  }
  if (strcmp(word, "level") == 0) {
    name = find_name(s->word[1], level_name);
    if (name < 0) {
      return complain(error, line, "expected worst, probable or quantile", s->word[1]);
    }
    p->level = name;
    return LM_OK;
  }
  return read_single(s, p, line, error);
}

lm_status lm_read_spec(const char *text, lm_problem *problem, lm_spec_error *error) {
  char found[LM_DECIMAL_MAX];
  char low[LM_DECIMAL_MAX];
  char high[LM_DECIMAL_MAX];
  statement s;
  lm_fault fault;
  lm_status status;
  int line = 1;
  if (text == NULL || problem == NULL || error == NULL) {
    return LM_NULL;
  }
  lm_start_problem(problem);
  for (; text != NULL; line++) {
    text = read_line(text, &s);
    if (s.cut) {
      return complain(error, line, "a line with too many words or characters", s.line);
    }
    if (s.count > 0) {
      status = read_statement(&s, problem, line, error);
      if (status != LM_OK) {
        return status;
      }
    }
  }
  status = lm_prepare_problem(problem, &fault);
  if (status != LM_OK) {
    error->line = 0;
    snprintf(error->text, sizeof error->text, "%s: %s (found %s, expected %s to %s)", fault.input,
             lm_status_sentence(status), lm_write_decimal(found, fault.found, 6),
             lm_write_decimal(low, fault.low, 6), lm_write_decimal(high, fault.high, 6));
  }
  return status;
}
