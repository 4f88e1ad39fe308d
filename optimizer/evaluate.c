#include "evaluate.h"

#include "lostmotion/checks.h"
#include "lostmotion/radial_gap.h"
#include "lostmotion/tolerance.h"
#include "real_math.h"

#define DEGREE (LM_PI / LM_REAL(180))
#define ARCMIN (DEGREE / LM_REAL(60))
#define ARCSEC (ARCMIN / LM_REAL(60))

/* Tolerance for rounding of sums: a fit may be exactly as tight as permitted. */
#define ROUNDING_MM LM_REAL(1e-9)

/* Unit of the size share of cost, mm^3. */
#define COST_VOLUME LM_REAL(1e4)

static lm_real larger(lm_real a, lm_real b) {
  return a > b ? a : b;
}

void lm_fill_values(const lm_problem *problem, int combination, const lm_real unit[],
                    lm_real value[LM_KEY_COUNT]) {
  int i;
  for (i = 0; i < LM_KEY_COUNT; i++) {
    value[i] = LM_REAL(problem->value[i]);
  }
  for (i = 0; i < problem->choice_count; i++) {
    const lm_choice *choice = &problem->choice[i];
    value[choice->key] = LM_REAL(choice->value[combination % choice->count]);
    combination /= choice->count;
  }
  for (i = 0; i < problem->range_count; i++) {
    const lm_range *range = &problem->range[i];
    value[range->key] = LM_REAL(range->low) + LM_REAL(range->high - range->low) * unit[i];
  }
}

/* --- the drive -------------------------------------------------------------------------------- */

/* The integer that a plain number represents. */
static int whole(lm_real value) {
  return (int)(value + LM_REAL(0.5));
}

/* A row of design_key_list.h as an assignment: the value in the unit of the search becomes the
 * member of lm_drive. */
#define UNIT_SAME(value) (value)
#define UNIT_IN_DEG(value) ((value) * DEGREE)
#define UNIT_IN_ARCMIN(value) ((value) * ARCMIN)
#define UNIT_FOLLOWS(value) (value)
#define MEMBER_REAL(value) (value)
#define MEMBER_COUNT(value) whole(value)
#define MEMBER_SWITCH(value) whole(value)
#define MEMBER_DEFORMATION(value) ((lm_deformation)whole(value))
#define MEMBER_GENERATOR(value) ((lm_generator_type)whole(value))
#define MEMBER_FLANK(value) ((lm_flank_kind)whole(value))
#define ASSIGN(id, section, stem, suffix, kind, per, low, high, file, usual, vary, meaning) \
  LM_OWNER_##section stem##suffix = MEMBER_##kind(UNIT_##vary(value[LM_KEY_##id]));

static void build_members(const lm_problem *problem, const lm_real value[], lm_drive *drive) {
  LM_DESIGN_KEYS(ASSIGN, ASSIGN)
  drive->teeth.rigid_teeth =
      drive->teeth.flexspline_teeth + (drive->teeth.deformation == LM_INTERNAL ? 2 : -2);
  if (problem->given[LM_KEY_SHIFT_DIFFERENCE]) {
    drive->teeth.rigid_shift = value[LM_KEY_FLEXSPLINE_SHIFT] + value[LM_KEY_SHIFT_DIFFERENCE];
  }
  if (problem->given[LM_KEY_DEFLECTION_MODULES]) {
    drive->generator.deflection_mm = value[LM_KEY_DEFLECTION_MODULES] * value[LM_KEY_MODULE_MM];
  }
}

static void build_chains(const lm_problem *problem, lm_drive *drive) {
  int i;
  drive->radial_law_count = problem->radial_count;
  for (i = 0; i < problem->radial_count; i++) {
    drive->radial_laws[i].coefficient_mm_per_Nn = LM_REAL(problem->radial[i][0]);
    drive->radial_laws[i].exponent = LM_REAL(problem->radial[i][1]);
    drive->radial_laws[i].share = LM_REAL(problem->radial[i][2]);
    drive->radial_laws[i].preload_N = LM_REAL(problem->radial[i][3]);
  }
  drive->torsion_count = problem->torsion_count;
  for (i = 0; i < problem->torsion_count; i++) {
    drive->torsion[i].stiffness_Nm_per_rad = LM_REAL(problem->torsion[i][0]);
    drive->torsion[i].ratio = LM_REAL(problem->torsion[i][1]);
  }
}

/* Diameter that determines a link's field. */
static lm_real diameter_of(const lm_graded_link *link, const lm_drive *drive) {
  return link->diameter_mm > 0 ? LM_REAL(link->diameter_mm)
                               : drive->teeth.module_mm * LM_REAL(drive->teeth.flexspline_teeth);
}

lm_status lm_grade_drive(const lm_problem *problem, const lm_real value[LM_KEY_COUNT],
                         lm_drive *drive, lm_fault *fault) {
  int i;
  drive->tolerance_count = problem->link_count;
  for (i = 0; i < problem->link_count; i++) {
    const lm_graded_link *graded = &problem->link[i];
    lm_tolerance_link *link = &drive->tolerances[i];
    lm_real field;
    const lm_status status = lm_it_tolerance_continuous(diameter_of(graded, drive),
                                                        value[LM_KEY_GRADE + i], &field, fault);
    if (status != LM_OK) {
      return status;
    }
    link->influence = LM_REAL(graded->influence);
    link->lower_mm = LM_REAL(graded->offset_mm) + LM_REAL(graded->position - 0.5) * field;
    link->upper_mm = LM_REAL(graded->offset_mm) + LM_REAL(graded->position + 0.5) * field;
    link->distribution = (lm_distribution)graded->distribution;
    link->zone = (lm_gap_zone)graded->zone;
  }
  return LM_OK;
}

lm_status lm_build_drive(const lm_problem *problem, const lm_real value[LM_KEY_COUNT],
                         lm_drive *drive, lm_fault *fault) {
  lm_status status;
  build_members(problem, value, drive);
  drive->ratio = LM_REAL(problem->ratio_sign) *
                 LM_REAL(problem->rigid_gear_turns ? drive->teeth.rigid_teeth
                                                   : drive->teeth.flexspline_teeth) /
                 LM_REAL(2);
  drive->rated_torque_Nm = LM_REAL(problem->rated_torque_Nm);
  build_chains(problem, drive);
  status = lm_grade_drive(problem, value, drive, fault);
  if (status == LM_OK) {
    status = lm_complete_drive(drive, fault);
  }
  if (status == LM_OK) {
    status = lm_check_drive(drive, fault);
  }
  return status;
}

/* --- tolerances ------------------------------------------------------------------------------- */

/* The radial gap at the stated level and in the mean, and the signed sum of each zone at its
 * tightest. */
typedef struct tolerance_state {
  lm_real gap_mm;
  lm_real mean_gap_mm;
  lm_real tightest_mm[LM_GAP_ZONES];
} tolerance_state;

/* Quantile of the clipped gap over the fixed samples: between the two order statistics
 * around n p - 1/2, here 2048 * 0.9973 - 0.5 = 2041.97. Therefore the seven largest are
 * kept, in rising order. */
#define KEPT 7
static lm_real sampled_gap(const lm_problem *problem, const lm_drive *drive) {
  const lm_real share = LM_REAL(0.9973 * LM_LOOP_SAMPLES - 0.5 - (LM_LOOP_SAMPLES - KEPT));
  lm_real reach[LM_LINK_MAX]; /* contribution of a link to its zone at the end of its field */
  lm_real middle[LM_GAP_ZONES];
  lm_real kept[KEPT];
  int s;
  int i;
  middle[LM_GENERATOR_GAP] = drive->gap.generator_mm;
  middle[LM_TEETH_GAP] = drive->gap.teeth_mm;
  for (i = 0; i < drive->tolerance_count; i++) {
    const lm_tolerance_link *link = &drive->tolerances[i];
    middle[link->zone] += link->influence * (link->lower_mm + link->upper_mm) / LM_REAL(2);
    reach[i] = link->influence * (link->upper_mm - link->lower_mm) / LM_REAL(2);
  }
  for (i = 0; i < KEPT; i++) {
    kept[i] = LM_REAL(0);
  }
  for (s = 0; s < LM_LOOP_SAMPLES; s++) {
    lm_real zone[LM_GAP_ZONES];
    lm_real gap;
    zone[LM_GENERATOR_GAP] = middle[LM_GENERATOR_GAP];
    zone[LM_TEETH_GAP] = middle[LM_TEETH_GAP];
    for (i = 0; i < drive->tolerance_count; i++) {
      zone[drive->tolerances[i].zone] += reach[i] * LM_REAL(problem->deviate[i][s]);
    }
    gap = larger(zone[LM_GENERATOR_GAP], LM_REAL(0)) + larger(zone[LM_TEETH_GAP], LM_REAL(0));
    for (i = 0; i < KEPT && gap > kept[i]; i++) {
      if (i > 0) {
        kept[i - 1] = kept[i];
      }
      kept[i] = gap;
    }
  }
  return kept[0] + share * (kept[1] - kept[0]);
}

static lm_status find_tolerance_state(const lm_problem *problem, const lm_drive *drive,
                                      tolerance_state *state, lm_fault *fault) {
  lm_tolerance_limits limits;
  lm_tolerance_limits worst;
  lm_status status;
  lm_real most = LM_REAL(0);
  lm_real nominal[LM_GAP_ZONES];
  lm_real high[LM_GAP_ZONES];
  lm_real low[LM_GAP_ZONES];
  int i;
  nominal[LM_GENERATOR_GAP] = drive->gap.generator_mm;
  nominal[LM_TEETH_GAP] = drive->gap.teeth_mm;
  status = lm_worst_limits(drive->tolerances, drive->tolerance_count, &worst, fault);
  if (status == LM_OK && problem->level != LM_LEVEL_WORST) {
    status =
        lm_probable_limits(drive->tolerances, drive->tolerance_count, LM_REAL(3), &limits, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  if (problem->level == LM_LEVEL_WORST) {
    limits = worst;
  }
  for (i = 0; i < LM_GAP_ZONES; i++) {
    state->tightest_mm[i] = nominal[i] + limits.signed_min_mm[i];
    low[i] = larger(state->tightest_mm[i], LM_REAL(0));
    high[i] = larger(nominal[i] + limits.signed_max_mm[i], LM_REAL(0));
    most += larger(nominal[i] + worst.signed_max_mm[i], LM_REAL(0));
  }
  state->mean_gap_mm = lm_mean_radial_gap(drive);
  if (problem->level == LM_LEVEL_QUANTILE) {
    state->gap_mm = sampled_gap(problem, drive);
  } else if (problem->level == LM_LEVEL_WORST) {
    state->gap_mm = high[0] + high[1];
  } else {
    /* The zones as independent intervals, not beyond the worst case, as lm_probable_limits adds
     * them. */
    const lm_real a = (high[0] - low[0]) / LM_REAL(2);
    const lm_real b = (high[1] - low[1]) / LM_REAL(2);
    const lm_real sum =
        (high[0] + low[0] + high[1] + low[1]) / LM_REAL(2) + real_sqrt(a * a + b * b);
    state->gap_mm = sum < most ? sum : most;
  }
  return LM_OK;
}

/* --- figures ---------------------------------------------------------------------------------- */

/* Rotation of the output that a radial gap adds at a torque. */
static lm_status gap_turn(const lm_drive *drive, const lm_mesh_state *mesh, lm_real gap_mm,
                          lm_real torque_Nm, lm_real *turn_rad, lm_fault *fault) {
  lm_real full;
  lm_real closing;
  lm_status status =
      lm_radial_gap_angle(gap_mm, mesh->flank_angle_rad, mesh->radius_mm, &full, fault);
  if (status == LM_OK) {
    status = lm_gap_closing_torque(gap_mm, mesh->radius_mm, drive->gap.ring_stiffness_N_per_mm,
                                   mesh->flank_angle_rad, &closing, fault);
  }
  if (status == LM_OK) {
    status = lm_gap_rotation(torque_Nm, closing, full, turn_rad, fault);
  }
  return status;
}

/* Whether the axial sections are those of the checks. */
static int has_face_sections(const lm_drive *drive) {
  return drive->axial_sections == lm_face_sections(drive);
}

/* The expensive part: contacts and their equilibrium at every tooth phase. */
static lm_status find_gapless(const lm_problem *problem, const lm_drive *drive,
                              lm_gapless gapless[], lm_design_workspace *workspace,
                              lm_fault *fault) {
  const lm_real pitch = LM_REAL(2) * LM_PI / LM_REAL(drive->teeth.flexspline_teeth);
  lm_real torque[LM_GAPLESS_TORQUES];
  int p;
  int t;
  torque[0] = LM_REAL(-problem->torque_Nm);
  torque[1] = LM_REAL(problem->torque_Nm);
  torque[2] = LM_REAL(problem->rated_torque_Nm);
  for (p = 0; p < problem->phases; p++) {
    const lm_real phase = pitch * LM_REAL(p) / LM_REAL(problem->phases);
    lm_contributions at[LM_GAPLESS_TORQUES];
    lm_status status = lm_evaluate_torsion_curve(drive, phase, torque, LM_GAPLESS_TORQUES, at,
                                                 &gapless[p].mesh, workspace, fault);
    if (status == LM_OK && has_face_sections(drive)) {
      status = lm_measure_load(drive, torque[2], workspace, &gapless[p].load, fault);
    }
    if (status != LM_OK) {
      return status;
    }
    for (t = 0; t < LM_GAPLESS_TORQUES; t++) {
      gapless[p].total_rad[t] = at[t].total_rad - at[t].radial_gap_rad;
    }
  }
  return LM_OK;
}

/* The figures of motion: the part without a gap, and the rotation due to the mean gap and that of
 * the level. */
static lm_status measure_motion(const lm_problem *problem, const lm_layout *layout,
                                const lm_drive *drive, const tolerance_state *tolerance,
                                const lm_gapless gapless[], lm_real result[], lm_fault *fault) {
  const lm_real torque = LM_REAL(problem->torque_Nm);
  const lm_real rated = LM_REAL(problem->rated_torque_Nm);
  lm_real loaded[LM_PHASE_MAX];
  int next = layout->figure_start[LM_FIGURE_KINEMATIC_ERROR];
  int p;
  int q;
  for (p = 0; p < problem->phases; p++) {
    const lm_mesh_state *mesh = &gapless[p].mesh;
    const lm_real *total = gapless[p].total_rad;
    lm_real level = LM_REAL(0);
    lm_real mean = LM_REAL(0);
    lm_real mean_loaded = LM_REAL(0);
    lm_status status = gap_turn(drive, mesh, tolerance->gap_mm, torque, &level, fault);
    if (status == LM_OK) {
      status = gap_turn(drive, mesh, tolerance->mean_gap_mm, torque, &mean, fault);
    }
    if (status == LM_OK) {
      status = gap_turn(drive, mesh, tolerance->mean_gap_mm, rated, &mean_loaded, fault);
    }
    if (status != LM_OK) {
      return status;
    }
    result[layout->figure_start[LM_FIGURE_LOST_MOTION] + p] =
        (total[1] - total[0] + LM_REAL(2) * mean) / ARCMIN;
    result[layout->figure_start[LM_FIGURE_TOLERANCE_LOST_MOTION] + p] =
        (total[1] - total[0] + LM_REAL(2) * level) / ARCMIN;
    result[layout->figure_start[LM_FIGURE_COMPLIANCE] + p] =
        (total[2] - total[1] + mean_loaded - mean) / (ARCMIN * (rated - torque));
    loaded[p] = mesh->middle_rad + total[2] + mean_loaded;
  }
  for (p = 0; p < problem->phases; p++) {
    for (q = 0; q < problem->phases; q++) {
      if (p != q) {
        result[next++] = (loaded[p] - loaded[q]) / ARCSEC;
      }
    }
  }
  if (problem->phases == 1) {
    result[next] = LM_REAL(0);
  }
  return LM_OK;
}

static lm_real cost_of(const lm_problem *problem, const lm_real value[], const lm_drive *drive) {
  const lm_cost_model *model = &problem->cost;
  const lm_real pitch = drive->teeth.module_mm * LM_REAL(drive->teeth.flexspline_teeth);
  const lm_real volume =
      LM_PI / LM_REAL(4) * pitch * pitch * drive->teeth.face_width_mm / COST_VOLUME;
  lm_real cost = LM_REAL(model->generator[drive->generator.type]) + LM_REAL(model->size) * volume;
  int i;
  for (i = 0; i < problem->link_count; i++) {
    /* A valid drive has fields. */
    const lm_real diameter = diameter_of(&problem->link[i], drive);
    lm_real field;
    lm_real usual;
    (void)lm_it_tolerance_continuous(diameter, value[LM_KEY_GRADE + i], &field, 0);
    (void)lm_it_tolerance(diameter, LM_COST_GRADE, &usual, 0);
    cost += LM_REAL(problem->link[i].cost_weight) *
            real_pow(usual / field, LM_REAL(model->tolerance_exponent));
  }
  return cost;
}

/* --- limits ----------------------------------------------------------------------------------- */

static lm_real outer_diameter(const lm_drive *drive, const lm_geometry *g) {
  const lm_real ring = LM_RING_SHARE * g->module_mm * LM_REAL(g->flexspline_teeth);
  const lm_real radius =
      g->deformation == LM_INTERNAL
          ? g->rigid_root_mm
          : g->neutral_mm + drive->flexspline.rim_thickness_mm / LM_REAL(2) + g->deflection_mm;
  return LM_REAL(2) * (radius + ring);
}

/* Interference of the radial chain at its tightest; -1: not limited. */
static lm_real interference_row(const lm_problem *problem, const lm_drive *drive,
                                const tolerance_state *tolerance) {
  if (!(problem->bounds.interference_max_mm >= 0)) {
    return LM_REAL(-1);
  }
  return (larger(-tolerance->tightest_mm[0], -tolerance->tightest_mm[1]) -
          LM_REAL(problem->bounds.interference_max_mm) - ROUNDING_MM) /
         drive->teeth.module_mm;
}

/* Rows by lm_limit; a row without a limit is -1. */
/* A row of the check list as a row of the search: MOST by value over limit, LEAST the other way. */
#define SHARE_MOST(check) ((check).value / (check).limit - LM_REAL(1))
#define SHARE_LEAST(check) ((check).limit / (check).value - LM_REAL(1))
#define CAPACITY_ROW(id, name, unit, scale, meaning) \
  row[LM_LIMIT_##id] = SHARE_##scale(check[LM_CHECK_##id]);

static void measure_limits(const lm_problem *problem, const lm_drive *drive, const lm_check check[],
                           const lm_geometry *g, lm_real row[]) {
  static const lm_check_id by_module[] = {LM_CHECK_FORM_RADIUS,  LM_CHECK_FLEXSPLINE_TIP,
                                          LM_CHECK_RIGID_TIP,    LM_CHECK_FLEXSPLINE_ROOT,
                                          LM_CHECK_RIGID_ROOT,   LM_CHECK_DISENGAGEMENT,
                                          LM_CHECK_FREE_ASSEMBLY};
  const lm_bounds *bounds = &problem->bounds;
  int i;
  for (i = 0; i < LM_LIMIT_BENDING_STRESS; i++) {
    row[i] = -check[by_module[i]].margin / drive->teeth.module_mm;
  }
  /* The root of the gear that the rack does not cut is as deep as its mate requires: it is not a
   * dimension of the drive and has no limit (involute.h sets it 0.2 modules beyond the nominal
   * wave). */
  row[g->deformation == LM_INTERNAL ? LM_LIMIT_RIGID_ROOT : LM_LIMIT_FLEXSPLINE_ROOT] = LM_REAL(-1);
  if (!bounds->free_assembly) {
    row[LM_LIMIT_FREE_ASSEMBLY] = LM_REAL(-1);
  }
  row[LM_LIMIT_BENDING_STRESS] =
      check[LM_CHECK_BENDING_STRESS].value / check[LM_CHECK_BENDING_STRESS].limit - LM_REAL(1);
  row[LM_LIMIT_TORSION_STRESS] =
      check[LM_CHECK_TORSION_STRESS].value / check[LM_CHECK_TORSION_STRESS].limit - LM_REAL(1);
  LM_CAPACITY_CHECKS(CAPACITY_ROW)
  row[LM_LIMIT_SAFETY] =
      LM_REAL(1) - check[LM_CHECK_SAFETY].value / LM_REAL(bounds->safety_factor_min);
  row[LM_LIMIT_OUTER_DIAMETER] = LM_REAL(-1);
  if (bounds->outer_diameter_max_mm > 0) {
    row[LM_LIMIT_OUTER_DIAMETER] =
        outer_diameter(drive, g) / LM_REAL(bounds->outer_diameter_max_mm) - LM_REAL(1);
  }
}

/* Reduction of a side clearance by the tightest tooth tolerances, which move the teeth together by
 * that radial distance. */
static lm_real gap_row(const lm_problem *problem, const tolerance_state *tolerance,
                       const lm_gap *gap) {
  lm_real clearance = gap->gap_rad;
  if (!real_isfinite(clearance)) {
    return LM_REAL(-LM_GAP_FREE_ARCMIN);
  }
  if (problem->bounds.gap_at_worst_corner && tolerance->tightest_mm[LM_TEETH_GAP] < LM_REAL(0)) {
    clearance +=
        tolerance->tightest_mm[LM_TEETH_GAP] * real_tan(gap->flank_angle_rad) / gap->radius_mm;
  }
  return LM_REAL(problem->bounds.gap_min_arcmin) - clearance / ARCMIN;
}

/* The end of one flank's overlap between two neighbouring angles; if there is none, a row that is
 * not active. */
static lm_real end_row(const lm_problem *problem, const tolerance_state *tolerance,
                       const lm_mesh *mesh, const lm_gap *gap, lm_real angle, const lm_gap *before,
                       lm_real angle_before, int forward) {
  lm_clearance_end end;
  if (!real_isfinite(before->gap_rad) || real_isfinite(gap->gap_rad)) {
    return LM_REAL(-LM_GAP_FREE_ARCMIN);
  }
  end = lm_find_overlap_end(mesh, angle_before, angle, forward);
  return gap_row(problem, tolerance, &end.gap);
}

/* The smallest gap of one flank between the angles of the scan: at the vertex of the parabola
 * through its largest row and both neighbours; without such a row inside, a row that is not active.
 * A search that compares only the angles of the scan finds the designs that interfere between them.
 * `row` is the flank's own at the first angle, the next one `stride` further. */
static lm_real vertex_row(const lm_problem *problem, const lm_scan *scan,
                          const tolerance_state *tolerance, const lm_mesh *mesh,
                          const lm_real row[], int stride, int forward) {
  lm_clearance clearance;
  lm_real rise;
  lm_real fall;
  lm_real step;
  int peak = 0;
  int i;
  for (i = 1; i < scan->rising; i++) {
    peak = row[i * stride] > row[peak * stride] ? i : peak;
  }
  if (peak == 0 || peak + 1 == scan->rising) {
    return LM_REAL(-LM_GAP_FREE_ARCMIN);
  }
  rise = row[peak * stride] - row[(peak - 1) * stride];
  fall = row[peak * stride] - row[(peak + 1) * stride];
  if (!(rise + fall > LM_REAL(0))) {
    return LM_REAL(-LM_GAP_FREE_ARCMIN);
  }
  step = LM_REAL(scan->angle[peak + 1].offset_rad - scan->angle[peak].offset_rad);
  clearance = lm_tooth_clearance(mesh, LM_REAL(scan->angle[peak].offset_rad) +
                                           step * (rise - fall) / (LM_REAL(2) * (rise + fall)));
  return gap_row(problem, tolerance, forward ? &clearance.forward : &clearance.backward);
}

/* Places of the face width at which the limits are evaluated: both edges, where the smallest gap is
 * with few exceptions, which the verification finds (lm_find_face_gap), or the middle if
 * planar_only is requested. */
static int edges_of(const lm_drive *drive) {
  return drive->planar_only ? 1 : LM_EDGES;
}

/* Where there are axial sections, the outer ones are the edges. */
static lm_status make_edges(const lm_drive *drive, int nodes, lm_design_workspace *workspace,
                            lm_fault *fault) {
  const int sections = drive->axial_sections;
  if ((sections > 1) == (edges_of(drive) > 1)) {
    workspace->face[0] = workspace->meshes[0];
    workspace->face[edges_of(drive) - 1] = workspace->meshes[sections - 1];
    return LM_OK;
  }
  return lm_make_face_like(drive, edges_of(drive), nodes, &workspace->meshes[0], workspace->face,
                           fault);
}

/* The angle varies slowest, then section, then flank; then come the ends of the overlap, then the
 * vertices. The angles that are measured from the axis are first and rise. */
static void measure_gaps(const lm_problem *problem, const lm_scan *scan, const lm_drive *drive,
                         const tolerance_state *tolerance, const lm_design_workspace *workspace,
                         lm_real row[]) {
  const lm_real junction = workspace->face[0].line.shape.contact_half_angle_rad;
  const int sections = edges_of(drive);
  lm_real *ends = row + 2 * scan->count * sections;
  lm_real *vertices = ends + 2 * sections;
  int section;
  int i;
  for (section = 0; section < sections; section++) {
    const lm_mesh *mesh = &workspace->face[section];
    lm_clearance before = lm_tooth_clearance(mesh, LM_REAL(0));
    ends[2 * section] = LM_REAL(-LM_GAP_FREE_ARCMIN);
    ends[2 * section + 1] = LM_REAL(-LM_GAP_FREE_ARCMIN);
    for (i = 0; i < scan->count; i++) {
      const lm_real angle = LM_REAL(scan->angle[i].offset_rad) +
                            (scan->angle[i].from_junction ? junction : LM_REAL(0));
      const lm_clearance clearance = lm_tooth_clearance(mesh, angle);
      lm_real *pair = row + 2 * (i * sections + section);
      pair[0] = gap_row(problem, tolerance, &clearance.forward);
      pair[1] = gap_row(problem, tolerance, &clearance.backward);
      if (i > 0 && i < scan->rising) {
        const lm_real last = LM_REAL(scan->angle[i - 1].offset_rad);
        ends[2 * section] = larger(
            ends[2 * section],
            end_row(problem, tolerance, mesh, &clearance.forward, angle, &before.forward, last, 1));
        ends[2 * section + 1] =
            larger(ends[2 * section + 1], end_row(problem, tolerance, mesh, &clearance.backward,
                                                  angle, &before.backward, last, 0));
      }
      before = clearance;
    }
    for (i = 0; i < 2; i++) {
      vertices[2 * section + i] =
          vertex_row(problem, scan, tolerance, mesh, row + 2 * section + i, 2 * sections, i == 0);
    }
  }
}

/* Results that depend on the tolerances but not on the angles. */
static lm_status measure_production(const lm_problem *problem, const lm_layout *layout,
                                    const lm_real value[], const lm_drive *drive,
                                    const tolerance_state *tolerance, const lm_gapless gapless[],
                                    lm_real result[], lm_fault *fault) {
  result[layout->figure_start[LM_FIGURE_COST]] = cost_of(problem, value, drive);
  result[layout->single_start + LM_LIMIT_INTERFERENCE] =
      interference_row(problem, drive, tolerance);
  return measure_motion(problem, layout, drive, tolerance, gapless, result, fault);
}

lm_status lm_measure_drive(const lm_problem *problem, const lm_scan *scan, const lm_layout *layout,
                           const lm_real value[LM_KEY_COUNT], const lm_drive *drive,
                           lm_real result[], lm_gapless gapless[LM_PHASE_MAX],
                           lm_design_workspace *workspace, lm_fault *fault) {
  tolerance_state tolerance;
  lm_check check[LM_CHECK_COUNT];
  lm_smallest_gap apart; /* the gaps have rows of their own */
  lm_load load;
  int p;
  lm_status status = find_tolerance_state(problem, drive, &tolerance, fault);
  apart.gap_rad = LM_REAL(0);
  apart.angle_rad = LM_REAL(0);
  apart.section = 0;
  apart.forward = 1;
  if (status == LM_OK) {
    status = lm_prepare_meshes(drive, scan->nodes, workspace, fault);
    workspace->near_only = 1;
  }
  if (status == LM_OK) {
    status = find_gapless(problem, drive, gapless, workspace, fault);
  }
  if (status == LM_OK) {
    status = make_edges(drive, scan->nodes, workspace, fault);
  }
  for (p = 0; p < problem->phases && status == LM_OK && has_face_sections(drive); p++) {
    lm_keep_worst_load(&gapless[p].load, p == 0, &load);
  }
  if (status == LM_OK && !has_face_sections(drive)) {
    status = lm_find_rated_load(drive, problem->phases, workspace, &load, fault);
  }
  if (status == LM_OK) {
    status = lm_check_design(drive, workspace->face, edges_of(drive), &apart, &load, check, fault);
  }
  if (status == LM_OK) {
    status = measure_production(problem, layout, value, drive, &tolerance, gapless, result, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  result[layout->figure_start[LM_FIGURE_STRESS]] = LM_REAL(1) / check[LM_CHECK_SAFETY].value;
  measure_limits(problem, drive, check, &workspace->face[0].geometry,
                 result + layout->single_start);
  measure_gaps(problem, scan, drive, &tolerance, workspace, result + layout->gap_start);
  return LM_OK;
}

lm_status lm_measure_tolerances(const lm_problem *problem, const lm_layout *layout,
                                const lm_real value[LM_KEY_COUNT], const lm_drive *drive,
                                const lm_gapless gapless[LM_PHASE_MAX], lm_real result[],
                                lm_fault *fault) {
  tolerance_state tolerance;
  const lm_status status = find_tolerance_state(problem, drive, &tolerance, fault);
  return status != LM_OK ? status
                         : measure_production(problem, layout, value, drive, &tolerance, gapless,
                                              result, fault);
}
