#include "lostmotion/checks.h"
#include "lostmotion/tooth_outline.h"

#include "half_turn.h"
#include "real_math.h"
#include "refuse.h"

/* Limits in modules: theory/check_values.md, limits of a design. */
#define TIP_THICKNESS LM_REAL(0.25)
#define RADIAL_CLEARANCE LM_REAL(0.15)
#define SAFETY LM_REAL(1.5)
#define ROOT_SAFETY LM_REAL(1.25)
#define SHEAR_MEAN_FACTOR LM_REAL(0.1)

#define NAME_OF(id, name, unit, scale, meaning) name,
#define UNIT_OF(id, name, unit, scale, meaning) unit,
#define MEANING_OF(id, name, unit, scale, meaning) meaning,

const char *lm_check_name(lm_check_id check) {
  static const char *const names[LM_CHECK_COUNT] = {LM_CHECKS(NAME_OF)};
  return (int)check >= 0 && check < LM_CHECK_COUNT ? names[check] : "";
}

const char *lm_check_unit(lm_check_id check) {
  static const char *const units[LM_CHECK_COUNT] = {LM_CHECKS(UNIT_OF)};
  return (int)check >= 0 && check < LM_CHECK_COUNT ? units[check] : "";
}

const char *lm_check_meaning(lm_check_id check) {
  static const char *const meanings[LM_CHECK_COUNT] = {LM_CHECKS(MEANING_OF)};
  return (int)check >= 0 && check < LM_CHECK_COUNT ? meanings[check] : "";
}

lm_real lm_rack_form_radius(const lm_teeth *teeth, int gear_teeth, lm_real shift) {
  const lm_real r = teeth->module_mm * LM_REAL(gear_teeth) / LM_REAL(2);
  const lm_real s = real_sin(teeth->pressure_angle_rad);
  const lm_real base = r * real_cos(teeth->pressure_angle_rad);
  const lm_real along = r * s + (shift - teeth->rack_addendum) * teeth->module_mm / s;
  return real_sqrt(base * base + along * along);
}

/* --- smallest gap ----------------------------------------------------------------------------- */

static lm_real gap_at(const lm_mesh *mesh, lm_real angle_rad, int forward) {
  const lm_clearance clearance = lm_tooth_clearance(mesh, angle_rad);
  return forward ? clearance.forward.gap_rad : clearance.backward.gap_rad;
}

static void keep_smaller(lm_smallest_gap *smallest, lm_real gap, lm_real angle, int section,
                         int forward) {
  if (gap < smallest->gap_rad) {
    smallest->gap_rad = gap;
    smallest->angle_rad = angle;
    smallest->section = section;
    smallest->forward = forward;
  }
}

/* The gap is smooth as long as the contact corner does not change, so a few parabola steps from the
 * best sample converge to a smooth minimum. At a kink they are harmless, because only smaller gaps
 * are kept. */
static void refine(const lm_mesh meshes[], lm_real step, lm_smallest_gap *smallest) {
  const lm_mesh *mesh = &meshes[smallest->section];
  lm_real width = step;
  int i;
  for (i = 0; i < 4; i++) {
    const lm_real middle = smallest->angle_rad;
    const lm_real at_middle = smallest->gap_rad;
    const lm_real below = gap_at(mesh, middle - width, smallest->forward);
    const lm_real above = gap_at(mesh, middle + width, smallest->forward);
    const lm_real bend = below - LM_REAL(2) * at_middle + above;
    const int section = smallest->section;
    const int forward = smallest->forward;
    keep_smaller(smallest, below, middle - width, section, forward);
    keep_smaller(smallest, above, middle + width, section, forward);
    if (bend > LM_REAL(0) && real_isfinite(bend)) {
      const lm_real vertex = middle + width * (below - above) / (LM_REAL(2) * bend);
      keep_smaller(smallest, gap_at(mesh, vertex, forward), vertex, section, forward);
    }
    width /= LM_REAL(4);
  }
}

/* One flank of one sample, and the end of its overlap between it and the sample before: the gap
 * jumps there, and may be smallest at the very end. The samples go away from the axis, where the
 * wave decreases, so a flank that leaves the overlap does not return. */
static void look_at_flank(const lm_mesh *mesh, lm_real gap, lm_real angle, lm_real gap_before,
                          lm_real angle_before, int section, int forward,
                          lm_smallest_gap *smallest) {
  keep_smaller(smallest, gap, angle, section, forward);
  if (real_isfinite(gap_before) && !real_isfinite(gap)) {
    const lm_clearance_end end = lm_find_overlap_end(mesh, angle_before, angle, forward);
    keep_smaller(smallest, end.gap.gap_rad, end.angle_rad, section, forward);
  }
}

static void look_at_sample(const lm_mesh *mesh, const lm_clearance *now, const lm_clearance *before,
                           int section, lm_smallest_gap *smallest) {
  look_at_flank(mesh, now->forward.gap_rad, now->angle_rad, before->forward.gap_rad,
                before->angle_rad, section, 1, smallest);
  look_at_flank(mesh, now->backward.gap_rad, now->angle_rad, before->backward.gap_rad,
                before->angle_rad, section, 0, smallest);
}

static lm_smallest_gap nothing_found(void) {
  lm_smallest_gap none;
  none.gap_rad = REAL_INFINITY;
  none.angle_rad = LM_REAL(0);
  none.section = 0;
  none.place = LM_REAL(0);
  none.forward = 1;
  return none;
}

static lm_status report_smallest(const lm_mesh meshes[], int sections, lm_real step,
                                 lm_smallest_gap found, lm_smallest_gap *smallest,
                                 lm_fault *fault) {
  if (!real_isfinite(found.gap_rad)) {
    return refuse(fault, LM_NO_CONTACT, "teeth.engagement_depth");
  }
  refine(meshes, step, &found);
  found.place = lm_section_place(found.section, sections);
  *smallest = found;
  return LM_OK;
}

/* Samples of one mesh from the deformation axis to the end of the overlap of both flanks. Of gaps
 * above the smallest one so far only that is of interest. */
static void scan(const lm_mesh meshes[], int section, int steps, lm_smallest_gap *found) {
  const lm_real step = HALF_PI / LM_REAL(steps);
  lm_clearance before = lm_tooth_clearance(&meshes[section], LM_REAL(0));
  int i;
  for (i = 0; i <= steps; i++) {
    const lm_clearance clearance =
        lm_clearance_within(&meshes[section], step * LM_REAL(i), found->gap_rad);
    look_at_sample(&meshes[section], &clearance, &before, section, found);
    before = clearance;
    if (!real_isfinite(clearance.forward.gap_rad) && !real_isfinite(clearance.backward.gap_rad)) {
      break;
    }
  }
}

static lm_status check_steps(int steps_per_pitch, lm_fault *fault) {
  return check_range(fault, "steps_per_pitch", LM_REAL(steps_per_pitch), LM_REAL(1), LM_REAL(64));
}

static int steps_of(const lm_mesh *mesh, int steps_per_pitch) {
  return (mesh->geometry.flexspline_teeth * steps_per_pitch + 3) / 4;
}

lm_status lm_find_smallest_gap(const lm_mesh meshes[], int sections, int steps_per_pitch,
                               lm_smallest_gap *smallest, lm_fault *fault) {
  lm_smallest_gap found = nothing_found();
  lm_status status;
  int steps;
  int section;
  if (meshes == 0 || smallest == 0) {
    return refuse(fault, LM_NULL, meshes == 0 ? "meshes" : "smallest");
  }
  status = check_range(fault, "sections", LM_REAL(sections), LM_REAL(1), LM_REAL(LM_SECTIONS_MAX));
  if (status == LM_OK) {
    status = check_steps(steps_per_pitch, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  steps = steps_of(&meshes[0], steps_per_pitch);
  for (section = 0; section < sections; section++) {
    scan(meshes, section, steps, &found);
  }
  return report_smallest(meshes, sections, HALF_PI / LM_REAL(steps), found, smallest, fault);
}

/* --- the whole face --------------------------------------------------------------------------- */

#define INNER_SHARE 4 /* fewer steps between the edges than at them */
#define FACE_ROUNDS 4

/* Smallest gap of one place, whose mesh is meshes[section]. */
static lm_smallest_gap gap_at_place(const lm_mesh meshes[], int section, lm_real place,
                                    int steps_per_pitch) {
  const int steps = steps_of(&meshes[section], steps_per_pitch);
  lm_smallest_gap found = nothing_found();
  scan(meshes, section, steps, &found);
  if (real_isfinite(found.gap_rad)) {
    refine(meshes, HALF_PI / LM_REAL(steps), &found);
  }
  found.section = section;
  found.place = place;
  return found;
}

/* The face around an inner place; its mesh is made anew at each place that is evaluated. */
typedef struct along_face {
  const lm_drive *drive;
  lm_mesh *meshes;
  int section;
  int nodes;
  int steps_per_pitch;
  lm_smallest_gap best;
} along_face;

static lm_status look_along(along_face *face, lm_real place, lm_real *gap, lm_fault *fault) {
  const lm_status status = lm_make_mesh_at(face->drive, place, face->nodes, &face->meshes[0],
                                           &face->meshes[face->section], fault);
  if (status == LM_OK) {
    const lm_smallest_gap now =
        gap_at_place(face->meshes, face->section, place, face->steps_per_pitch);
    *gap = now.gap_rad;
    if (now.gap_rad < face->best.gap_rad) {
      face->best = now;
    }
  }
  return status;
}

/* As refine, along the face. */
static lm_status refine_place(along_face *face, lm_fault *fault) {
  lm_real width = LM_REAL(1) / LM_REAL(LM_FACE_PLACES - 1);
  lm_status status = LM_OK;
  int i;
  for (i = 0; i < FACE_ROUNDS && status == LM_OK; i++) {
    const lm_real middle = face->best.place;
    const lm_real at_middle = face->best.gap_rad;
    lm_real below = REAL_INFINITY;
    lm_real above = REAL_INFINITY;
    lm_real bend;
    if (middle - width >= LM_REAL(0)) {
      status = look_along(face, middle - width, &below, fault);
    }
    if (status == LM_OK && middle + width <= LM_REAL(1)) {
      status = look_along(face, middle + width, &above, fault);
    }
    bend = below - LM_REAL(2) * at_middle + above;
    if (status == LM_OK && bend > LM_REAL(0) && real_isfinite(bend)) {
      lm_real gap;
      const lm_real vertex = middle + width * (below - above) / (LM_REAL(2) * bend);
      if (vertex > LM_REAL(0) && vertex < LM_REAL(1)) {
        status = look_along(face, vertex, &gap, fault);
      }
    }
    width /= LM_REAL(4);
  }
  return status;
}

lm_status lm_find_face_gap(const lm_drive *drive, int nodes, int steps_per_pitch, lm_mesh meshes[],
                           lm_smallest_gap *smallest, lm_fault *fault) {
  const int inner_steps = (steps_per_pitch + INNER_SHARE - 1) / INNER_SHARE;
  lm_smallest_gap at[LM_FACE_PLACES];
  lm_smallest_gap found = nothing_found();
  lm_status status;
  int places;
  int i;
  if (drive == 0 || meshes == 0 || smallest == 0) {
    return refuse(fault, LM_NULL, "drive, meshes, smallest");
  }
  places = lm_face_places(drive);
  status = check_steps(steps_per_pitch, fault);
  if (status == LM_OK) {
    status = lm_make_face(drive, places, nodes, meshes, fault);
  }
  for (i = 0; i < places && status == LM_OK; i++) {
    const int is_edge = i == 0 || i == places - 1;
    at[i] = gap_at_place(meshes, i, lm_section_place(i, places),
                         is_edge ? steps_per_pitch : inner_steps);
    if (is_edge && at[i].gap_rad < found.gap_rad) {
      found = at[i];
    }
  }
  for (i = 1; i < places - 1 && status == LM_OK; i++) {
    if (at[i].gap_rad < at[i - 1].gap_rad && at[i].gap_rad < at[i + 1].gap_rad) {
      along_face face = {drive, meshes, i, nodes, steps_per_pitch, at[i]};
      status = refine_place(&face, fault);
      if (face.best.gap_rad < found.gap_rad) {
        found = face.best;
      }
    }
  }
  if (status == LM_OK && !real_isfinite(found.gap_rad)) {
    status = refuse(fault, LM_NO_CONTACT, "teeth.engagement_depth");
  }
  if (status == LM_OK) {
    *smallest = found;
  }
  return status;
}

lm_status lm_refine_smallest_gap(const lm_mesh meshes[], int sections,
                                 const lm_clearance *const swept[], int count, int phases,
                                 lm_smallest_gap *smallest, lm_fault *fault) {
  lm_smallest_gap found = nothing_found();
  lm_status status;
  int steps;
  int section;
  int i;
  if (meshes == 0 || swept == 0 || smallest == 0) {
    return refuse(fault, LM_NULL, "meshes, swept, smallest");
  }
  status = check_range(fault, "sections", LM_REAL(sections), LM_REAL(1), LM_REAL(LM_SECTIONS_MAX));
  if (status == LM_OK) {
    status =
        check_range(fault, "phases", LM_REAL(phases), LM_REAL(1), LM_REAL(LM_SWEEP_PHASES_MAX));
  }
  if (status != LM_OK) {
    return status;
  }
  for (section = 0; section < sections; section++) {
    for (i = count / 2; i < count; i++) {
      const lm_clearance *c = &swept[section][i];
      look_at_sample(&meshes[section], c, i > count / 2 ? c - 1 : c, section, &found);
    }
  }
  steps = meshes[0].geometry.flexspline_teeth * phases / 4;
  return report_smallest(meshes, sections, HALF_PI / LM_REAL(steps), found, smallest, fault);
}

/* --- geometry --------------------------------------------------------------------------------- */

static lm_check at_least(lm_real value, lm_real limit) {
  lm_check check;
  check.value = value;
  check.limit = limit;
  check.margin = value - limit;
  return check;
}

static lm_check at_most(lm_real value, lm_real limit) {
  lm_check check;
  check.value = value;
  check.limit = limit;
  check.margin = limit - value;
  return check;
}

/* Tip thickness of a tooth whose flank is given as its own half angle. */
static lm_real outward_thickness(lm_involute_point at, lm_real radius) {
  return LM_REAL(2) * radius * at.half_angle_rad;
}

/* Tip thickness of an internal tooth, whose flank is given as the half angle of the space. */
static lm_real inward_thickness(lm_involute_point at, lm_real radius, int teeth) {
  return LM_REAL(2) * radius * (LM_PI / LM_REAL(teeth) - at.half_angle_rad);
}

/* Thickness of the flexspline's tooth at its tip. */
static lm_real own_tip_thickness(const lm_mesh *mesh) {
  const lm_geometry *g = &mesh->geometry;
  const lm_real radius = g->flexspline_tip_mm;
  if (mesh->flank.kind != LM_FLANK_INVOLUTE) {
    return LM_REAL(2) * lm_evaluate_tooth_flank(&mesh->flank, mesh->flank.high_mm).across_mm;
  }
  return g->deformation == LM_INTERNAL
             ? outward_thickness(lm_evaluate_involute(&g->flexspline, radius), radius)
             : inward_thickness(lm_evaluate_involute(&g->flexspline, radius), radius,
                                g->flexspline_teeth);
}

/* Lower end of the flank of the external teeth: the end of the involute cut by the rack, or the
 * root fillet of any other flank. */
static lm_real form_radius(const lm_drive *drive, const lm_mesh *mesh) {
  const lm_teeth *t = &drive->teeth;
  const int rigid = mesh->geometry.deformation == LM_EXTERNAL;
  lm_tooth_outline outline;
  if ((rigid ? mesh->rigid_kind : mesh->flank.kind) == LM_FLANK_INVOLUTE) {
    return rigid ? lm_rack_form_radius(t, t->rigid_teeth, t->rigid_shift)
                 : lm_rack_form_radius(t, t->flexspline_teeth, t->flexspline_shift);
  }
  lm_make_tooth_outline(drive, mesh, rigid, &outline);
  return outline.root_mm + outline.form_height_mm;
}

/* Deflection of the widest axial section, the last one, and opposite displacement at 90 deg of the
 * free zone of the narrowest one, the first. */
static void widest_wave(const lm_mesh meshes[], int sections, lm_real *deflection,
                        lm_real *retreat) {
  const lm_wave across = lm_evaluate_shape(&meshes[0].line.shape, HALF_PI);
  *deflection = meshes[sections - 1].line.deflection_mm;
  *retreat = meshes[0].line.deflection_mm * real_fabs(across.radial);
}

static void check_geometry(const lm_drive *drive, const lm_mesh meshes[], int sections,
                           lm_check checks[]) {
  const lm_geometry *g = &meshes[0].geometry;
  const lm_real tip = TIP_THICKNESS * g->module_mm;
  const lm_real clearance = RADIAL_CLEARANCE * g->module_mm;
  lm_real w;
  lm_real retreat;
  widest_wave(meshes, sections, &w, &retreat);
  checks[LM_CHECK_FLEXSPLINE_TIP] = at_least(own_tip_thickness(&meshes[0]), tip);
  if (g->deformation == LM_INTERNAL) {
    checks[LM_CHECK_FORM_RADIUS] = at_least(g->rigid_tip_mm - w, form_radius(drive, &meshes[0]));
    checks[LM_CHECK_RIGID_TIP] =
        at_least(inward_thickness(lm_rigid_flank_at(&meshes[0], g->rigid_tip_mm), g->rigid_tip_mm,
                                  g->rigid_teeth),
                 tip);
    checks[LM_CHECK_FLEXSPLINE_ROOT] =
        at_least(g->rigid_tip_mm - w - g->flexspline_root_mm, clearance);
    checks[LM_CHECK_RIGID_ROOT] = at_least(g->rigid_root_mm - g->flexspline_tip_mm - w, clearance);
    checks[LM_CHECK_DISENGAGEMENT] =
        at_least(g->rigid_tip_mm - g->flexspline_tip_mm + retreat, LM_REAL(0));
    checks[LM_CHECK_FREE_ASSEMBLY] = at_least(g->rigid_tip_mm - g->flexspline_tip_mm, LM_REAL(0));
  } else {
    checks[LM_CHECK_FORM_RADIUS] =
        at_least(g->flexspline_tip_mm - w, form_radius(drive, &meshes[0]));
    checks[LM_CHECK_RIGID_TIP] = at_least(
        outward_thickness(lm_rigid_flank_at(&meshes[0], g->rigid_tip_mm), g->rigid_tip_mm), tip);
    checks[LM_CHECK_FLEXSPLINE_ROOT] =
        at_least(g->flexspline_root_mm - w - g->rigid_tip_mm, clearance);
    checks[LM_CHECK_RIGID_ROOT] = at_least(g->flexspline_tip_mm - w - g->rigid_root_mm, clearance);
    checks[LM_CHECK_DISENGAGEMENT] =
        at_least(g->flexspline_tip_mm + retreat - g->rigid_tip_mm, LM_REAL(0));
    checks[LM_CHECK_FREE_ASSEMBLY] = at_least(g->flexspline_tip_mm - g->rigid_tip_mm, LM_REAL(0));
  }
}

/* --- strength --------------------------------------------------------------------------------- */

static void check_strength(const lm_drive *drive, const lm_mesh meshes[], int sections,
                           lm_check checks[]) {
  const lm_material *steel = &drive->material;
  const lm_shape *shape = &meshes[0].line.shape;
  const lm_real r = meshes[0].geometry.neutral_mm;
  const lm_real s = drive->flexspline.rim_thickness_mm;
  const lm_real plate =
      steel->youngs_modulus_MPa / (LM_REAL(1) - steel->poisson_ratio * steel->poisson_ratio);
  lm_real w;
  lm_real retreat;
  lm_real per_curvature;
  lm_real tension;
  lm_real amplitude;
  lm_real shear;
  lm_real bending_safety;
  lm_real shear_safety;
  widest_wave(meshes, sections, &w, &retreat);
  per_curvature = steel->tooth_stress_factor * plate * s * w / (LM_REAL(2) * r * r);
  /* Hoop force of the preloaded ring, half of the wave generator's force; E I of the rim alone, per
   * unit of its section b s. */
  tension = lm_shape_generator_force(shape) / LM_REAL(2) * steel->youngs_modulus_MPa * s * s /
            LM_REAL(12) * w / (r * r * r);
  amplitude = per_curvature * lm_shape_curvature_amplitude(shape);
  shear = drive->rated_torque_Nm * LM_REAL(1000) /
          (LM_REAL(2) * LM_PI * r * r * drive->flexspline.wall_thickness_mm);
  bending_safety = steel->bending_fatigue_MPa /
                   (steel->bending_notch_factor * amplitude +
                    steel->mean_stress_factor *
                        (per_curvature * lm_largest_shape_curvature(shape) - amplitude + tension));
  shear_safety = steel->shear_fatigue_MPa /
                 ((steel->shear_notch_factor + SHEAR_MEAN_FACTOR) * shear / LM_REAL(2));
  checks[LM_CHECK_BENDING_STRESS] =
      at_most(per_curvature * lm_largest_shape_curvature(shape), steel->bending_fatigue_MPa);
  checks[LM_CHECK_TORSION_STRESS] = at_most(shear, steel->shear_fatigue_MPa);
  checks[LM_CHECK_SAFETY] =
      at_least(bending_safety * shear_safety /
                   real_sqrt(bending_safety * bending_safety + shear_safety * shear_safety),
               SAFETY);
}

static void check_capacity(const lm_drive *drive, const lm_mesh meshes[], const lm_load *load,
                           lm_check checks[]) {
  const lm_material *steel = &drive->material;
  const lm_real radius = meshes[0].geometry.neutral_mm;
  const lm_real root = LM_REAL(2) * steel->bending_fatigue_MPa /
                       (ROOT_SAFETY * (steel->bending_notch_factor + steel->mean_stress_factor));
  checks[LM_CHECK_FLANK_PRESSURE] = at_most(load->flank_pressure_MPa, steel->flank_pressure_MPa);
  checks[LM_CHECK_FLEXSPLINE_ROOT_STRESS] = at_most(load->flexspline_root_MPa, root);
  checks[LM_CHECK_RIGID_ROOT_STRESS] = at_most(load->rigid_root_MPa, root);
  checks[LM_CHECK_RATCHETING] =
      at_least(load->ratcheting_torque_Nm, LM_REAL(LM_RATCHETING_FACTOR) * drive->rated_torque_Nm);
  checks[LM_CHECK_CUP_BUCKLING] = at_least(lm_cup_buckling_torque(drive, radius),
                                           LM_REAL(LM_BUCKLING_FACTOR) * drive->rated_torque_Nm);
  checks[LM_CHECK_CONING_STRESS] =
      at_most(lm_coning_stress(drive, radius), steel->bending_fatigue_MPa / SAFETY);
  checks[LM_CHECK_BEARING_LIFE] =
      at_least(lm_bearing_life(drive, load, LM_REAL(LM_LIFE_SPEED_RPM)), LM_REAL(LM_LIFE_H));
}

lm_status lm_check_design(const lm_drive *drive, const lm_mesh meshes[], int sections,
                          const lm_smallest_gap *smallest, const lm_load *load,
                          lm_check checks[LM_CHECK_COUNT], lm_fault *fault) {
  if (drive == 0 || meshes == 0 || smallest == 0 || load == 0 || checks == 0) {
    return refuse(fault, LM_NULL, "drive, meshes, smallest, load, checks");
  }
  if (sections < 1 || sections > LM_SECTIONS_MAX) {
    return refuse_range(fault, "sections", LM_REAL(sections), LM_REAL(1), LM_REAL(LM_SECTIONS_MAX));
  }
  check_geometry(drive, meshes, sections, checks);
  check_strength(drive, meshes, sections, checks);
  check_capacity(drive, meshes, load, checks);
  checks[LM_CHECK_SMALLEST_GAP] = at_least(smallest->gap_rad, LM_REAL(0));
  return LM_OK;
}
