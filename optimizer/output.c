#include "output.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "decimal.h"
#include "lostmotion/design_keys.h"
#include "platform.h"
#include "workspace.h"

#define DEGREE (3.14159265358979323846 / 180.0)
#define ARCMIN (DEGREE / 60.0)

/* A number with every bit, and the text before and after it. */
static void write_exact(FILE *file, const char *before, double value, const char *after) {
  char text[LM_DECIMAL_MAX];
  fprintf(file, "%s%s%s", before, lm_write_decimal(text, value, LM_DECIMAL_EXACT), after);
}

static void write_number(FILE *file, const char *key, double value) {
  fprintf(file, "%s = ", key);
  write_exact(file, "", value, "\n");
}

/* A row of design_key_list.h as a line of a drive file. */
#define WRITE_REAL(key, value) write_number(file, key, value)
#define WRITE_COUNT(key, value) fprintf(file, "%s = %d\n", key, value)
#define WRITE_SWITCH(key, value) fprintf(file, "%s = %s\n", key, (value) ? "true" : "false")
#define WRITE_DEFORMATION(key, value) \
  fprintf(file, "%s = \"%s\"\n", key, lm_deformation_name((int)(value)))
#define WRITE_GENERATOR(key, value) \
  fprintf(file, "%s = \"%s\"\n", key, lm_generator_name((int)(value)))
#define WRITE_FLANK(key, value) fprintf(file, "%s = \"%s\"\n", key, lm_flank_name((int)(value)))
#define WRITE(id, section, stem, suffix, kind, per, low, high, file_, usual, vary, meaning) \
  WRITE_##kind(#stem #suffix, LM_OWNER_##section stem##suffix);

void lm_write_drive(FILE *file, const lm_drive *drive, const char *name) {
  int i;
  fprintf(file, "[drive]\nname = \"%s\"\n", name);
  write_number(file, "ratio", drive->ratio);
  write_number(file, "rated_torque_Nm", drive->rated_torque_Nm);
  fprintf(file, "\n[design]\n");
  LM_DRIVE_KEYS(WRITE, WRITE)
  fprintf(file, "\n[design.teeth]\n");
  LM_TEETH_KEYS(WRITE, WRITE)
  fprintf(file, "\n[design.generator]\n");
  LM_GENERATOR_KEYS(WRITE, WRITE)
  fprintf(file, "\n[design.flexspline]\n");
  LM_FLEXSPLINE_KEYS(WRITE, WRITE)
  fprintf(file, "\n[design.material]\n");
  LM_MATERIAL_KEYS(WRITE, WRITE)
  fprintf(file, "\n[design.support]\n");
  LM_SUPPORT_KEYS(WRITE, WRITE)
  fprintf(file, "\n[design.gap]\n");
  LM_GAP_KEYS(WRITE, WRITE)
  if (drive->teeth.flexspline_flank != LM_FLANK_INVOLUTE ||
      drive->teeth.rigid_flank != LM_FLANK_INVOLUTE) {
    fprintf(file, "\n[design.flank]\n");
    LM_FLANK_KEYS(WRITE, WRITE)
  }
  for (i = 0; i < drive->radial_law_count; i++) {
    const lm_radial_law *law = &drive->radial_laws[i];
    fprintf(file, "\n[[design.radial_chain]]\nkind = \"power\"\n");
    write_number(file, "deflection_mm", law->coefficient_mm_per_Nn);
    fprintf(file, "force_N = 1\n");
    write_number(file, "exponent", law->exponent);
    write_number(file, "share", law->share);
    write_number(file, "preload_N", law->preload_N);
  }
  for (i = 0; i < drive->torsion_count; i++) {
    fprintf(file, "\n[[design.torsion_chain]]\nkind = \"stiffness\"\n");
    write_number(file, "stiffness_Nm_per_rad", drive->torsion[i].stiffness_Nm_per_rad);
    write_number(file, "ratio", drive->torsion[i].ratio);
  }
  for (i = 0; i < drive->tolerance_count; i++) {
    const lm_tolerance_link *link = &drive->tolerances[i];
    fprintf(file, "\n[[design.tolerance]]\nkind = \"link\"\nzone = \"%s\"\n",
            lm_zone_name((int)link->zone));
    write_number(file, "influence", link->influence);
    write_number(file, "lower_mm", link->lower_mm);
    write_number(file, "upper_mm", link->upper_mm);
    fprintf(file, "distribution = \"%s\"\n", lm_distribution_name((int)link->distribution));
  }
}

/* --- front ------------------------------------------------------------------------------------ */

/* A chosen value as in a drive file. */
static void write_choice(FILE *file, const lm_problem *problem, int combination, int choice) {
  const double value = lm_chosen_value(problem, combination, choice);
  const int key = problem->choice[choice].key;
  if (key == LM_KEY_GENERATOR_TYPE) {
    fprintf(file, "%s", lm_generator_name((int)value));
  } else if (key == LM_KEY_DEFORMATION) {
    fprintf(file, "%s", lm_deformation_name((int)value));
  } else if (key == LM_KEY_FLEXSPLINE_FLANK || key == LM_KEY_RIGID_FLANK) {
    fprintf(file, "%s", lm_flank_name((int)value));
  } else {
    write_exact(file, "", value, "");
  }
}

/* A whole grade is written as such: its share of the range is rounded. */
static double range_value(const lm_range *range, double unit) {
  const double value = range->low + (range->high - range->low) * unit;
  return range->whole && fabs(value - round(value)) <= 1e-9 ? round(value) : value;
}

/* The search minimises a compliance; in all output it is a stiffness. */
#define FIGURE_NAME_MAX 64

static void name_figure(int figure, char name[FIGURE_NAME_MAX]) {
  if (figure == LM_FIGURE_COMPLIANCE) {
    snprintf(name, FIGURE_NAME_MAX, "stiffness_Nm_per_rad");
  } else {
    snprintf(name, FIGURE_NAME_MAX, "%s_%s", lm_figure_name(figure), lm_figure_unit(figure));
  }
}

static double show_figure(int figure, double value) {
  return figure == LM_FIGURE_COMPLIANCE ? 1.0 / (ARCMIN * value) : value;
}

double lm_margin_of(const lm_problem *problem, const lm_layout *layout, const double result[],
                    int limit) {
  double row = result[layout->single_start + (limit < LM_SINGLE_ROWS ? limit : 0)];
  int i;
  if (limit == LM_LIMIT_GAP) {
    row = -HUGE_VAL;
    for (i = 0; i < layout->gap_count; i++) {
      row = result[layout->gap_start + i] > row ? result[layout->gap_start + i] : row;
    }
  } else if (limit >= LM_LIMIT_FIGURE) {
    const double most = problem->bounds.figure_max[limit - LM_LIMIT_FIGURE];
    row = most > 0 ? lm_figure_of(layout, result, limit - LM_LIMIT_FIGURE) / most - 1 : -1;
  }
  return -lm_share_of_limit(limit, row);
}

void lm_measure_design(const lm_problem *problem, lm_measured *measured, lm_workspace *workspace) {
  const lm_solution *design = &measured->design;
  double *result = workspace->task_result;
  lm_layout layout;
  lm_scan scan;
  int i;
  lm_default_scan(&scan);
  lm_lay_out(problem, &scan, &layout);
  measured->computed = lm_find_known_result(problem, &scan, &layout, design->combination,
                                            design->unit, result, workspace) == LM_OK;
  for (i = 0; i < LM_FIGURE_COUNT && measured->computed; i++) {
    measured->figure[i] = lm_figure_of(&layout, result, i);
  }
  for (i = 0; i < LM_LIMIT_COUNT && measured->computed; i++) {
    measured->margin[i] = lm_margin_of(problem, &layout, result, i);
  }
}

void lm_write_designs(FILE *file, const lm_problem *problem, const lm_measured measured[],
                      int count) {
  char key[LM_KEY_NAME_MAX];
  int n;
  int i;
  fprintf(file, "verified");
  for (i = 0; i < problem->choice_count; i++) {
    lm_write_key(problem->choice[i].key, key);
    fprintf(file, ",%s", key);
  }
  for (i = 0; i < problem->range_count; i++) {
    lm_write_key(problem->range[i].key, key);
    fprintf(file, ",%s", key);
  }
  for (i = 0; i < LM_FIGURE_COUNT; i++) {
    char name[FIGURE_NAME_MAX];
    name_figure(i, name);
    fprintf(file, ",%s", name);
  }
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    fprintf(file, ",margin_%s", lm_limit_name(i));
  }
  fprintf(file, "\n");
  for (n = 0; n < count; n++) {
    const lm_measured *m = &measured[n];
    if (!m->computed) {
      continue;
    }
    fprintf(file, "%d", m->design.verified);
    for (i = 0; i < problem->choice_count; i++) {
      fprintf(file, ",");
      write_choice(file, problem, m->design.combination, i);
    }
    for (i = 0; i < problem->range_count; i++) {
      write_exact(file, ",", range_value(&problem->range[i], m->design.unit[i]), "");
    }
    for (i = 0; i < LM_FIGURE_COUNT; i++) {
      write_exact(file, ",", show_figure(i, m->figure[i]), "");
    }
    for (i = 0; i < LM_LIMIT_COUNT; i++) {
      write_exact(file, ",", m->margin[i], "");
    }
    fprintf(file, "\n");
  }
}

void lm_write_combinations(FILE *file, const lm_problem *problem, const lm_search *search) {
  const int count = lm_count_combinations(problem);
  char key[LM_KEY_NAME_MAX];
  int n;
  int i;
  for (i = 0; i < problem->choice_count; i++) {
    lm_write_key(problem->choice[i].key, key);
    fprintf(file, "%s,", key);
  }
  fprintf(file, "fate,pruned_by\n");
  for (n = 0; n < count; n++) {
    int limit = 0;
    const int fate = lm_read_fate(search, n, &limit);
    for (i = 0; i < problem->choice_count; i++) {
      write_choice(file, problem, n, i);
      fprintf(file, ",");
    }
    fprintf(file, "%s,%s\n", lm_fate_name(fate),
            fate != LM_FATE_PRUNED ? ""
            : limit < 0            ? "wave generator against deformation"
                                   : lm_limit_name(limit));
  }
}

/* --- JSON ------------------------------------------------------------------------------------- */

/* A number in JSON; null if it is not finite. */
static void write_json(FILE *file, const char *key, double value, const char *after) {
  if (isfinite(value)) {
    fprintf(file, "\"%s\": ", key);
    write_exact(file, "", value, after);
  } else {
    fprintf(file, "\"%s\": null%s", key, after);
  }
}

static void write_figures(FILE *file, const char *key, const double figure[]) {
  int i;
  fprintf(file, " \"%s\": {", key);
  for (i = 0; i < LM_FIGURE_COUNT; i++) {
    char name[FIGURE_NAME_MAX];
    name_figure(i, name);
    write_json(file, name, show_figure(i, figure[i]), i + 1 < LM_FIGURE_COUNT ? ", " : "},\n");
  }
}

/* Ranges with the design at one end, and the price of that end. */
static void write_ends(FILE *file, const lm_problem *problem, const lm_certificate *c) {
  char key[LM_KEY_NAME_MAX];
  int first = 1;
  int k;
  for (k = 0; k < problem->range_count; k++) {
    const lm_range *range = &problem->range[k];
    if (c->end[k] == 0) {
      continue;
    }
    lm_write_key(range->key, key);
    fprintf(file, "%s\n  {\"key\": \"%s\", \"end\": \"%s\", ", first ? "" : ",", key,
            c->end[k] < 0 ? "low" : "high");
    write_json(file, "value", c->end[k] < 0 ? range->low : range->high, ", ");
    write_json(file, "price", c->end_price[k], "}");
    first = 0;
  }
}

void lm_write_certificate(FILE *file, const lm_problem *problem, int combination,
                          const lm_certificate *c) {
  int i;
  fprintf(file, "{\"schema\": \"lostmotion.certificate/1\", \"holds\": %s, \"combination\": %d,\n",
          c->holds ? "true" : "false", combination);
  write_figures(file, "figures", c->figure);
  write_figures(file, "figures_as_searched", c->search_figure);
  fprintf(file, " \"limits\": [");
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    const lm_limit_report *limit = &c->limit[i];
    fprintf(file, "%s\n  {\"name\": \"%s\", \"stated\": %s, ", i > 0 ? "," : "", lm_limit_name(i),
            limit->stated ? "true" : "false");
    write_json(file, "margin", -lm_share_of_limit(i, -limit->margin), ", ");
    fprintf(file, "\"binds\": %s, ", limit->binds ? "true" : "false");
    write_json(file, "multiplier", limit->multiplier, "}");
  }
  fprintf(file, "],\n \"checks\": [");
  for (i = 0; i < LM_CHECK_COUNT; i++) {
    fprintf(file, "%s\n  {\"name\": \"%s\", \"unit\": \"%s\", ", i > 0 ? "," : "",
            lm_check_name((lm_check_id)i), lm_check_unit((lm_check_id)i));
    write_json(file, "value", c->check[i].value, ", ");
    write_json(file, "limit", c->check[i].limit, ", ");
    write_json(file, "margin", c->check[i].margin, "}");
  }
  fprintf(file, "],\n \"at_ends\": [");
  write_ends(file, problem, c);
  fprintf(file, "],\n \"smallest_gap\": {");
  write_json(file, "gap_arcmin", c->smallest.gap_rad / ARCMIN, ", ");
  write_json(file, "angle_deg", c->smallest.angle_rad / DEGREE, ", ");
  write_json(file, "place", c->smallest.place, ", ");
  fprintf(file, "\"forward\": %s},\n", c->smallest.forward ? "true" : "false");
  fprintf(file, " \"lost_motion_arcmin\": {");
  write_json(file, "worst", c->lost_motion_worst, ", ");
  write_json(file, "probable", c->lost_motion_probable, ", ");
  write_json(file, "median", c->lost_motion_median.value, ", ");
  write_json(file, "median_standard_error", c->lost_motion_median.standard_error, ", ");
  write_json(file, "quantile_9973", c->lost_motion_quantile.value, ", ");
  write_json(file, "quantile_9973_standard_error", c->lost_motion_quantile.standard_error, "},\n");
  fprintf(file, " \"tolerance_percent\": [");
  for (i = 0; i < problem->link_count; i++) {
    fprintf(file, "%s{", i > 0 ? ", " : "");
    write_json(file, "worst", c->worst_percent[i], ", ");
    write_json(file, "probable", c->probable_percent[i], "}");
  }
  fprintf(file, "],\n ");
  write_json(file, "optimality_residual", c->residual, "}\n");
}

double lm_stated_relaxation(int limit, double row, double module_mm, const char **unit) {
  if (limit == LM_LIMIT_INTERFERENCE) {
    *unit = "mm";
    return row * module_mm;
  }
  *unit = limit == LM_LIMIT_GAP             ? "arcmin"
          : limit < LM_LIMIT_BENDING_STRESS ? "modules"
                                            : "share of the limit";
  return lm_share_of_limit(limit, row);
}

void lm_write_relaxation(FILE *file, const double relax[LM_LIMIT_COUNT], double module_mm) {
  int first = 1;
  int i;
  fprintf(file, "{\"schema\": \"lostmotion.infeasible/1\", \"relax\": [");
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    if (relax[i] > LM_RESERVE) {
      const char *unit;
      const double by = lm_stated_relaxation(i, relax[i], module_mm, &unit);
      fprintf(file, "%s{\"limit\": \"%s\", \"unit\": \"%s\", ", first ? "" : ", ", lm_limit_name(i),
              unit);
      write_json(file, "by", by, ", ");
      fprintf(file, "\"set_by_spec\": %s}", lm_is_set_by_spec(i) ? "true" : "false");
      first = 0;
    }
  }
  fprintf(file, "]}\n");
}

void lm_write_progress(FILE *file, const lm_progress *p, double seconds, double left) {
  static const char *const stages[] = {"screen", "evolve", "race",   "polish",
                                       "spread", "repair", "verify", "done"};
  fprintf(file, "{\"stage\": \"%s\", \"evaluations\": %d, \"budget\": %d, \"tasks\": %d, ",
          stages[p->stage], p->evaluations, p->budget, p->tasks_done);
  write_json(file, "best", p->has_best ? p->best_value : HUGE_VAL, ", ");
  write_json(file, "feasible_share", p->feasible_share, ", ");
  fprintf(file, "\"refused\": %d, \"front\": %d, \"combinations\": {", p->refused, p->front_size);
  fprintf(file, "\"solved\": %d, \"dominated\": %d, \"pruned\": %d, \"not_reached\": %d}, ",
          p->fate[LM_FATE_SOLVED], p->fate[LM_FATE_DOMINATED], p->fate[LM_FATE_PRUNED],
          p->fate[LM_FATE_NOT_REACHED]);
  write_json(file, "seconds", seconds, ", ");
  write_json(file, "seconds_left", left < 0 ? HUGE_VAL : left, "}\n");
}
