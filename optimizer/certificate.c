#include "certificate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "lostmotion/radial_gap.h"
#include "lostmotion/torsion_curve.h"
#include "run_task.h"
#include "workspace.h"

#define SAMPLES_LOG2 14
#define SCRAMBLINGS 8
#define ARCMIN (LM_PI / 10800.0)

/* Coordinate descent on the multipliers ends far below the accuracy that is required of them. */
#define SWEEPS 400

/* Lost motion at a radial gap: its value without a gap, plus the share of the gap, (9), (9a). */
static double lost_motion_at(const lm_certificate *c, const lm_gapless *phase, double gap_mm,
                             double torque_Nm) {
  const lm_mesh_state *mesh = &phase->mesh;
  double full = 0;
  double closing = 0;
  double turned = 0;
  (void)lm_radial_gap_angle(gap_mm, mesh->flank_angle_rad, mesh->radius_mm, &full, NULL);
  (void)lm_gap_closing_torque(gap_mm, mesh->radius_mm, c->drive.gap.ring_stiffness_N_per_mm,
                              mesh->flank_angle_rad, &closing, NULL);
  (void)lm_gap_rotation(torque_Nm, closing, full, &turned, NULL);
  return (phase->total_rad[1] - phase->total_rad[0] + 2 * turned) / ARCMIN;
}

/* The links of the drive, and its nominal gaps as links without tolerance: lm_prepare_problem
 * leaves room for them. */
static int all_links(const lm_drive *drive, lm_tolerance_link link[]) {
  const double nominal[LM_GAP_ZONES] = {drive->gap.generator_mm, drive->gap.teeth_mm};
  int count = drive->tolerance_count;
  int zone;
  memcpy(link, drive->tolerances, (size_t)count * sizeof link[0]);
  for (zone = 0; zone < LM_GAP_ZONES; zone++) {
    if (nominal[zone] > 0) {
      link[count].influence = 1;
      link[count].lower_mm = nominal[zone];
      link[count].upper_mm = nominal[zone];
      link[count].distribution = LM_UNIFORM;
      link[count].zone = (lm_gap_zone)zone;
      count++;
    }
  }
  return count;
}

/* Of the phases that were evaluated last, the one with the largest lost motion at a radial gap. */
static const lm_gapless *worst_phase(const lm_certificate *c, const lm_gapless gapless[],
                                     double gap_mm, double torque_Nm) {
  const lm_gapless *worst = &gapless[0];
  int p;
  for (p = 1; p < LM_CERTAIN_PHASES; p++) {
    if (lost_motion_at(c, &gapless[p], gap_mm, torque_Nm) >
        lost_motion_at(c, worst, gap_mm, torque_Nm)) {
      worst = &gapless[p];
    }
  }
  return worst;
}

/* From the results of the fine evaluation in the workspace. */
static lm_status certify_tolerances(const lm_problem *problem, lm_certificate *c,
                                    const lm_gapless gapless[], lm_fault *fault) {
  const double torque_Nm = problem->torque_Nm;
  lm_tolerance_link link[LM_TOLERANCE_CHAIN_MAX];
  const int count = all_links(&c->drive, link);
  const size_t length = LM_SAMPLE_GAP_WORKSPACE(SAMPLES_LOG2);
  double *samples = (double *)malloc(length * sizeof *samples);
  lm_sampling_plan plan;
  const lm_gapless *worst_at;
  lm_tolerance_limits worst;
  lm_tolerance_limits probable;
  double slope;
  lm_status status = samples == NULL ? LM_TOO_SMALL : LM_OK;
  plan.samples_log2 = SAMPLES_LOG2;
  plan.scramblings = SCRAMBLINGS;
  plan.seed = problem->seed + 1000003u; /* samples other than those of the search */
  plan.low_probability = 0.00135;
  plan.high_probability = 0.9973;
  plan.limit_mm = 1e4;
  if (status == LM_OK) {
    status = lm_worst_limits(link, count, &worst, fault);
  }
  if (status == LM_OK) {
    status = lm_probable_limits(link, count, 3, &probable, fault);
  }
  if (status == LM_OK) {
    status = lm_tolerance_contributions(c->drive.tolerances, c->drive.tolerance_count,
                                        c->worst_percent, c->probable_percent, fault);
  }
  if (status == LM_OK) {
    status = lm_sample_gap(link, count, &plan, samples, length, &c->gap, fault);
  }
  free(samples);
  if (status != LM_OK) {
    return status;
  }
  worst_at = worst_phase(c, gapless, c->gap.high_mm.value, torque_Nm);
  c->lost_motion_worst = lost_motion_at(c, worst_at, worst.total_max_mm, torque_Nm);
  c->lost_motion_probable = lost_motion_at(c, worst_at, probable.total_max_mm, torque_Nm);
  /* Lost motion rises with the gap, so its quantiles are those of the gap; the standard error goes
   * through the slope. */
  slope = 2 * tan(worst_at->mesh.flank_angle_rad) / worst_at->mesh.radius_mm / ARCMIN;
  c->lost_motion_median.value = lost_motion_at(c, worst_at, c->gap.median_mm.value, torque_Nm);
  c->lost_motion_median.standard_error = slope * c->gap.median_mm.standard_error;
  c->lost_motion_quantile.value = lost_motion_at(c, worst_at, c->gap.high_mm.value, torque_Nm);
  c->lost_motion_quantile.standard_error = slope * c->gap.high_mm.standard_error;
  return LM_OK;
}

/* --- sensitivities ---------------------------------------------------------------------------- */

/* Limit to which a result belongs (a figure: its own limit). */
static int limit_at(const lm_layout *layout, int place) {
  int figure = LM_FIGURE_COUNT - 1;
  if (place >= layout->gap_start) {
    return LM_LIMIT_GAP;
  }
  if (place >= layout->single_start) {
    return place - layout->single_start;
  }
  while (place < layout->figure_start[figure]) {
    figure--;
  }
  return LM_LIMIT_FIGURE + figure;
}

/* Multipliers of the binding limits: the objective's derivatives as a sum, with weights >= 0, of
 * those of the limits and of the bounds of the ranges; least squares by coordinate descent. The
 * objective's own largest branches share its derivative: at a kink of the largest phase their
 * weights add up to 1, which a heavy row requires. */
#define LM_END (-3)
#define COLUMNS_MAX (LM_BRANCH_MAX + LM_RESULT_MAX + LM_FREE_MAX)

typedef struct column {
  double by[LM_FREE_MAX + 1];
  double weight;
  int limit; /* -2: branch of the objective, LM_END - k: end of range k */
} column;

static void solve_multipliers(column columns[], int count, int n, double *residual) {
  double left[LM_FREE_MAX + 1] = {0};
  double size = 0;
  int sweep;
  int i;
  int k;
  left[n] = 1; /* the branches' weights add up to 1 */
  for (sweep = 0; sweep < SWEEPS; sweep++) {
    for (i = 0; i < count; i++) {
      double along = 0;
      double square = 0;
      double step;
      for (k = 0; k <= n; k++) {
        along += columns[i].by[k] * left[k];
        square += columns[i].by[k] * columns[i].by[k];
      }
      step = square > 0 ? along / square : 0;
      step = step < -columns[i].weight ? -columns[i].weight : step;
      columns[i].weight += step;
      for (k = 0; k <= n; k++) {
        left[k] -= step * columns[i].by[k];
      }
    }
  }
  *residual = 0;
  for (k = 0; k < n; k++) {
    *residual += left[k] * left[k];
  }
  for (i = 0; i < count && columns[i].limit == -2; i++) {
    double square = 0;
    for (k = 0; k < n; k++) {
      square += columns[i].by[k] * columns[i].by[k];
    }
    size = square > size ? square : size;
  }
  *residual = size > 0 ? sqrt(*residual / size) : 0;
}

static void add_column(column columns[], int *count, int limit, const double by[], int n,
                       double scale) {
  column *c = &columns[(*count)++];
  int k;
  for (k = 0; k < n; k++) {
    c->by[k] = by[k] * scale;
  }
  c->by[n] = 0;
  c->weight = 0;
  c->limit = limit;
}

/* result and slope at the point, on the fine scan of the search's own phases. */
static void find_multipliers(const lm_problem *problem, const lm_layout *layout,
                             const double unit[], const double result[], const double slope[],
                             column columns[], lm_certificate *c) {
  const int n = problem->range_count;
  const int lead = problem->objective[0];
  const double largest = lm_figure_of(layout, result, lead);
  double heavy = 0;
  int count = 0;
  int branches;
  int i;
  int k;
  for (i = 0; i < layout->figure_count[lead]; i++) {
    const int place = layout->figure_start[lead] + i;
    if (result[place] >= largest - LM_BINDING * fabs(largest)) {
      add_column(columns, &count, -2, slope + place * n, n, 1);
      for (k = 0; k < n; k++) {
        heavy = fabs(slope[place * n + k]) > heavy ? fabs(slope[place * n + k]) : heavy;
      }
    }
  }
  branches = count;
  for (i = 0; i < layout->count; i++) {
    const int limit = limit_at(layout, i);
    double scale = 1;
    double row = result[i];
    if (limit >= LM_LIMIT_FIGURE) {
      const double most = problem->bounds.figure_max[limit - LM_LIMIT_FIGURE];
      scale = most > 0 ? 1 / most : 0;
      row = most > 0 ? result[i] / most - 1 : -1;
    }
    if (row > -LM_BINDING) {
      add_column(columns, &count, limit, slope + i * n, n, scale);
    }
  }
  for (k = 0; k < n; k++) {
    double by[LM_FREE_MAX] = {0};
    by[k] = unit[k] <= 1e-9 ? -1 : unit[k] >= 1 - 1e-9 ? 1 : 0;
    if (by[k] != 0) {
      c->end[k] = by[k] > 0 ? 1 : -1;
      add_column(columns, &count, LM_END - k, by, n, 1);
    }
  }
  /* sum w_b grad f_b + sum l grad g = 0 with sum w_b = 1; scaled so that both weigh the same */
  for (i = 0; i < branches; i++) {
    for (k = 0; k < n; k++) {
      columns[i].by[k] /= heavy > 0 ? heavy : 1;
    }
    columns[i].by[n] = 1;
  }
  solve_multipliers(columns, count, n, &c->residual);
  for (i = branches; i < count; i++) {
    if (columns[i].limit <= LM_END) {
      c->end_price[LM_END - columns[i].limit] = columns[i].weight * (heavy > 0 ? heavy : 1);
    } else if (columns[i].limit >= 0) {
      c->limit[columns[i].limit].multiplier += columns[i].weight * (heavy > 0 ? heavy : 1);
    }
  }
}

static lm_status certify_sensitivities(const lm_problem *problem, const lm_scan *scan,
                                       int combination, const double unit[], lm_certificate *c,
                                       lm_workspace *workspace, lm_fault *fault) {
  double *result = (double *)malloc(LM_RESULT_MAX * sizeof *result);
  double *slope = (double *)malloc((size_t)LM_RESULT_MAX * LM_FREE_MAX * sizeof *slope);
  column *columns = (column *)malloc(COLUMNS_MAX * sizeof *columns);
  lm_layout layout;
  lm_status status = LM_TOO_SMALL;
  int figure;
  lm_lay_out(problem, scan, &layout);
  if (result != NULL && slope != NULL && columns != NULL) {
    status = lm_evaluate_slopes(problem, scan, &layout, combination, unit, result, slope, workspace,
                                fault);
  }
  if (status == LM_OK) {
    for (figure = 0; figure < LM_FIGURE_COUNT; figure++) {
      c->search_figure[figure] = lm_figure_of(&layout, result, figure);
    }
    find_multipliers(problem, &layout, unit, result, slope, columns, c);
  }
  free(result);
  free(slope);
  free(columns);
  return status;
}

/* --- limits ----------------------------------------------------------------------------------- */

static void read_limits(const lm_problem *problem, const lm_layout *layout, const double result[],
                        lm_certificate *c) {
  int i;
  for (i = 0; i < LM_LIMIT_COUNT; i++) {
    lm_limit_report *limit = &c->limit[i];
    double row = -HUGE_VAL;
    int k;
    if (i < LM_SINGLE_ROWS) {
      row = result[layout->single_start + i];
      limit->stated = row != -1.0;
    } else if (i == LM_LIMIT_GAP) {
      limit->stated = 1;
      for (k = 0; k < layout->gap_count; k++) {
        row = result[layout->gap_start + k] > row ? result[layout->gap_start + k] : row;
      }
      if (!problem->bounds.gap_at_worst_corner) {
        row = fmax(row, problem->bounds.gap_min_arcmin - c->smallest.gap_rad / ARCMIN);
      }
    } else {
      const double most = problem->bounds.figure_max[i - LM_LIMIT_FIGURE];
      limit->stated = most > 0;
      row = most > 0 ? c->figure[i - LM_LIMIT_FIGURE] / most - 1 : -1;
    }
    limit->margin = -row;
    limit->binds = limit->stated && row > -LM_BINDING;
    if (limit->stated && !(row <= 0)) {
      c->holds = 0;
    }
  }
}

lm_status lm_certify(const lm_problem *problem, int combination, const double unit[],
                     lm_certificate *certificate, lm_workspace *workspace, lm_fault *fault) {
  lm_certificate *c = certificate;
  lm_problem *finer;
  lm_layout layout;
  lm_scan scan;
  double *result;
  lm_status status;
  int figure;
  if (problem == NULL || unit == NULL || certificate == NULL || workspace == NULL) {
    return LM_NULL;
  }
  memset(c, 0, sizeof *c);
  status = lm_point_drive(problem, combination, unit, &c->drive, fault);
  if (status == LM_OK) {
    status = lm_find_face_gap(&c->drive, LM_CERTAIN_NODES, LM_CERTAIN_STEPS, workspace->design.face,
                              &c->smallest, fault);
  }
  if (status == LM_OK) {
    status = lm_find_rated_load(&c->drive, LM_CERTAIN_PHASES, &workspace->design, &c->load, fault);
  }
  if (status == LM_OK) {
    status = lm_check_design(&c->drive, workspace->design.face, lm_face_places(&c->drive),
                             &c->smallest, &c->load, c->check, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  lm_default_scan(&scan);
  scan.angle[scan.count].offset_rad = c->smallest.angle_rad;
  scan.angle[scan.count].from_junction = 0;
  scan.count++;
  status = certify_sensitivities(problem, &scan, combination, unit, c, workspace, fault);
  finer = (lm_problem *)malloc(sizeof *finer);
  result = (double *)malloc(LM_RESULT_MAX * sizeof *result);
  if (finer == NULL || result == NULL) {
    status = LM_TOO_SMALL;
  }
  if (status == LM_OK) {
    *finer = *problem;
    finer->phases = LM_CERTAIN_PHASES;
    finer->damaged_share = 0;
    scan.nodes = LM_CERTAIN_NODES;
    lm_lay_out(finer, &scan, &layout);
    status = lm_evaluate_point(finer, &scan, &layout, combination, unit, result, workspace, fault);
  }
  if (status == LM_OK) {
    status = certify_tolerances(problem, c, workspace->gapless, fault);
  }
  if (status == LM_OK) {
    c->holds = 1;
    for (figure = 0; figure < LM_FIGURE_COUNT; figure++) {
      c->figure[figure] = lm_figure_of(&layout, result, figure);
    }
    read_limits(problem, &layout, result, c);
  }
  free(finer);
  free(result);
  return status;
}
