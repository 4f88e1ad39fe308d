#include "lostmotion/torsion_curve.h"
#include "lostmotion/radial_gap.h"
#include "lostmotion/rim_support.h"
#include "lostmotion/tooth_bending.h"
#include "lostmotion/tooth_outline.h"

#include "real_math.h"
#include "refuse.h"

/* --- compliance of a pair of teeth, eq (6), tabulated over the loaded radius ------------------ */

static lm_tooth_material material_of(const lm_drive *drive) {
  lm_tooth_material material;
  material.youngs_modulus_MPa = drive->material.youngs_modulus_MPa;
  material.shear_modulus_MPa = drive->material.shear_modulus_MPa;
  material.poisson_ratio = drive->material.poisson_ratio;
  material.plane_strain = 1; /* a tooth is an order of magnitude wider than high */
  return material;
}

/* `own` is the flank as lm_make_geometry gives it; pitch_half_rad is half the pitch angle if that
 * is the flank of a SPACE (the tooth is the rest of the pitch), 0 if it is the tooth's own. */
static lm_status tabulate_give(const lm_involute_tooth *tooth, const lm_involute *own,
                               lm_real pitch_half_rad, lm_real low_mm, lm_real high_mm,
                               const lm_drive *drive, lm_give_table *table, lm_fault *fault) {
  const lm_real width = drive->teeth.face_width_mm;
  const lm_tooth_material material = material_of(drive);
  int i;
  table->low_mm = low_mm;
  table->step_mm = (high_mm - low_mm) / LM_REAL(LM_GIVE_NODES - 1);
  for (i = 0; i < LM_GIVE_NODES; i++) {
    const lm_real radius = low_mm + table->step_mm * LM_REAL(i);
    const lm_involute_point at = lm_evaluate_involute(own, radius);
    const lm_real angle = at.pressure_angle_rad - at.half_angle_rad + pitch_half_rad;
    const lm_real half =
        pitch_half_rad > LM_REAL(0) ? pitch_half_rad - at.half_angle_rad : at.half_angle_rad;
    lm_tooth_compliance bending;
    lm_real tilt; /* of the tooth in the rim */
    lm_status status;
    if (!(half > LM_REAL(0))) { /* pointed before its tip */
      return refuse_contradiction(fault, "teeth.tooth_height", LM_REAL(2) * half * radius,
                                  LM_REAL(0), REAL_INFINITY);
    }
    status = lm_involute_tooth_compliance(tooth, radius, width, angle, &material, &bending, fault);
    if (status == LM_OK) {
      status =
          lm_involute_foundation_compliance(tooth, radius, width, angle, &material, &tilt, fault);
    }
    if (status != LM_OK) {
      return status;
    }
    table->give_mm_per_N[i] = bending.total_mm_per_N + tilt;
  }
  return LM_OK;
}

/* Where the path of the tip's corner reverses, the generated flank is nearly perpendicular to the
 * force; there is no contact, but the table has a node. */
#define ANGLE_MIN LM_REAL(-0.5)
#define ANGLE_MAX LM_REAL(1.3)

/* The same by quadrature on the outline of a tooth with its fillet. */
static lm_status tabulate_outline(const lm_tooth_outline *outline, lm_real low_mm, lm_real high_mm,
                                  const lm_drive *drive, lm_give_table *table, lm_fault *fault) {
  const lm_real width = drive->teeth.face_width_mm;
  const lm_real root = LM_REAL(2) * lm_outline_flank(outline, LM_REAL(0)).half_mm;
  const lm_tooth_material material = material_of(drive);
  int i;
  int k;
  table->low_mm = low_mm;
  table->step_mm = (high_mm - low_mm) / LM_REAL(LM_GIVE_NODES - 1);
  for (i = 0; i < LM_GIVE_NODES; i++) {
    const lm_real height = real_fabs(low_mm + table->step_mm * LM_REAL(i) - outline->root_mm);
    const lm_real share =
        outline->form_height_mm < height ? outline->form_height_mm / height : LM_REAL(1);
    lm_real angle = lm_outline_flank(outline, height).angle_rad;
    lm_real half[LM_TOOTH_SAMPLES];
    lm_tooth_compliance bending;
    lm_real tilt;
    lm_status status;
    angle = angle < ANGLE_MIN ? ANGLE_MIN : angle;
    angle = angle > ANGLE_MAX ? ANGLE_MAX : angle;
    for (k = 0; k < LM_TOOTH_SAMPLES; k++) {
      half[k] = lm_outline_half(outline, lm_tooth_sample_height(k, share) * height);
      if (!(half[k] > LM_REAL(0))) { /* pointed before its tip */
        return refuse_contradiction(fault, "teeth.tooth_height", LM_REAL(2) * half[k], LM_REAL(0),
                                    REAL_INFINITY);
      }
    }
    status =
        lm_tooth_outline_compliance(half, share, height, width, angle, &material, &bending, fault);
    if (status == LM_OK) {
      status = lm_foundation_compliance(height, root, width, angle, &material, &tilt, fault);
    }
    if (status != LM_OK) {
      return status;
    }
    table->give_mm_per_N[i] = bending.total_mm_per_N + tilt;
  }
  return LM_OK;
}

static lm_real look_up_give(const lm_give_table *table, lm_real radius_mm) {
  const lm_real place = (radius_mm - table->low_mm) / table->step_mm;
  int i = place > LM_REAL(0) ? (int)place : 0;
  i = i < LM_GIVE_NODES - 1 ? i : LM_GIVE_NODES - 2;
  return table->give_mm_per_N[i] +
         (place - LM_REAL(i)) * (table->give_mm_per_N[i + 1] - table->give_mm_per_N[i]);
}

static lm_real larger(lm_real a, lm_real b) {
  return a > b ? a : b;
}

static lm_status give_of_outline(const lm_drive *drive, const lm_mesh *mesh, int rigid,
                                 lm_real low_mm, lm_real high_mm, lm_give_table *table,
                                 lm_fault *fault) {
  lm_tooth_outline own;
  lm_make_tooth_outline(drive, mesh, rigid, &own);
  return tabulate_outline(&own, low_mm, high_mm, drive, table, fault);
}

/* External deformation: the flexspline's teeth point inward, */
static lm_status give_of_ring_teeth(const lm_drive *drive, const lm_mesh *mesh, lm_real high_mm,
                                    lm_give_table *table, lm_fault *fault) {
  const lm_geometry *g = &mesh->geometry;
  const lm_teeth *t = &drive->teeth;
  lm_involute_tooth inward;
  const lm_status status = lm_make_involute_tooth(
      LM_TOOTH_INWARD, t->module_mm, t->flexspline_teeth, t->flexspline_shift,
      t->pressure_angle_rad, g->flexspline_root_mm, &inward, fault);
  return status != LM_OK
             ? status
             : tabulate_give(&inward, &g->flexspline, LM_PI / LM_REAL(t->flexspline_teeth),
                             g->flexspline_tip_mm, high_mm, drive, table, fault);
}

/* the rigid gear's outward. */
static lm_status give_of_rigid_teeth(const lm_drive *drive, const lm_mesh *mesh, lm_real low_mm,
                                     lm_give_table *table, lm_fault *fault) {
  const lm_geometry *g = &mesh->geometry;
  const lm_teeth *t = &drive->teeth;
  lm_involute_tooth outward;
  const lm_status status =
      lm_make_involute_tooth(LM_TOOTH_OUTWARD, t->module_mm, t->rigid_teeth, t->rigid_shift,
                             t->pressure_angle_rad, g->rigid_root_mm, &outward, fault);
  return status != LM_OK ? status
                         : tabulate_give(&outward, &g->rigid, LM_REAL(0), low_mm, g->rigid_tip_mm,
                                         drive, table, fault);
}

/* Internal deformation: the flexspline's teeth point outward, */
static lm_status give_of_external_teeth(const lm_drive *drive, const lm_mesh *mesh, lm_real hair,
                                        lm_give_table *table, lm_fault *fault) {
  const lm_geometry *g = &mesh->geometry;
  const lm_teeth *t = &drive->teeth;
  const lm_real low = larger(g->rigid_tip_mm - g->deflection_mm, g->flexspline_root_mm);
  lm_involute_tooth outward;
  lm_status status;
  if (mesh->flank.kind != LM_FLANK_INVOLUTE) {
    return give_of_outline(drive, mesh, 0, low + hair, g->flexspline_tip_mm, table, fault);
  }
  status = lm_make_involute_tooth(LM_TOOTH_OUTWARD, t->module_mm, t->flexspline_teeth,
                                  t->flexspline_shift, t->pressure_angle_rad, g->flexspline_root_mm,
                                  &outward, fault);
  return status != LM_OK ? status
                         : tabulate_give(&outward, &g->flexspline, LM_REAL(0),
                                         larger(low, g->flexspline.base_mm) + hair,
                                         g->flexspline_tip_mm, drive, table, fault);
}

/* the rigid gear's inward. */
static lm_status give_of_internal_teeth(const lm_drive *drive, const lm_mesh *mesh,
                                        lm_give_table *table, lm_fault *fault) {
  const lm_geometry *g = &mesh->geometry;
  const lm_teeth *t = &drive->teeth;
  const lm_real high = g->flexspline_tip_mm + g->deflection_mm;
  lm_involute_tooth inward;
  lm_status status;
  if (mesh->rigid_kind != LM_FLANK_INVOLUTE) {
    return give_of_outline(drive, mesh, 1, g->rigid_tip_mm, high, table, fault);
  }
  status = lm_make_involute_tooth(LM_TOOTH_INWARD, t->module_mm, t->rigid_teeth, t->rigid_shift,
                                  t->pressure_angle_rad, g->rigid_root_mm, &inward, fault);
  return status != LM_OK ? status
                         : tabulate_give(&inward, &g->rigid, LM_PI / LM_REAL(t->rigid_teeth),
                                         g->rigid_tip_mm, high, drive, table, fault);
}

/* The loaded radii go from the reach of the mating tip to the gear's own tip; at the load there
 * must be an involute, and tooth below it. */
static lm_status prepare_give(const lm_drive *drive, const lm_mesh *mesh, lm_pair_give *give,
                              lm_fault *fault) {
  const lm_geometry *g = &mesh->geometry;
  const lm_real w = g->deflection_mm;
  const lm_real hair = LM_REAL(0.02) * g->module_mm;
  lm_status status;
  give->fixed_mm_per_N = drive->support.tooth_compliance_mm_per_N;
  if (give->fixed_mm_per_N > LM_REAL(0)) {
    return LM_OK;
  }
  if (g->deformation == LM_INTERNAL) {
    status = give_of_external_teeth(drive, mesh, hair, &give->flexspline, fault);
    if (status == LM_OK) {
      status = give_of_internal_teeth(drive, mesh, &give->rigid, fault);
    }
  } else {
    const lm_real high = g->rigid_tip_mm + w;
    const lm_real low = larger(g->flexspline_tip_mm - w, g->rigid_root_mm);
    status =
        mesh->flank.kind != LM_FLANK_INVOLUTE
            ? give_of_outline(drive, mesh, 0, g->flexspline_tip_mm, high, &give->flexspline, fault)
            : give_of_ring_teeth(drive, mesh, high, &give->flexspline, fault);
    if (status == LM_OK) {
      status =
          mesh->rigid_kind != LM_FLANK_INVOLUTE
              ? give_of_outline(drive, mesh, 1, low + hair, g->rigid_tip_mm, &give->rigid, fault)
              : give_of_rigid_teeth(drive, mesh, larger(low, g->rigid.base_mm) + hair, &give->rigid,
                                    fault);
    }
  }
  return status;
}

/* Along the force; the flexspline's own radius of the contact follows from its foot on the neutral
 * line. */
static lm_real give_at(const lm_pair_give *give, const lm_mesh *mesh, lm_real foot_mm,
                       lm_real contact_mm) {
  if (give->fixed_mm_per_N > LM_REAL(0)) {
    return give->fixed_mm_per_N;
  }
  return look_up_give(&give->flexspline, contact_mm - foot_mm + mesh->geometry.neutral_mm) +
         look_up_give(&give->rigid, contact_mm);
}

/* --- candidates for contact ------------------------------------------------------------------- */

/* The pair that touches first on a flank. */
typedef struct nearest {
  lm_real gap_rad;
  lm_real flank_angle_rad;
} nearest;

/* A tooth that is on the engagement limit counts in both precisions: 2 arcsec of slack. */
#define EDGE LM_REAL(1e-5)

static void find_nearest(const lm_clearance clearances[], int count, lm_real limit_rad,
                         nearest *forward, nearest *backward) {
  int i;
  for (i = 0; i < count; i++) {
    const lm_clearance *c = &clearances[i];
    if (real_fabs(c->angle_rad) <= limit_rad + EDGE) {
      if (c->forward.gap_rad < forward->gap_rad) {
        forward->gap_rad = c->forward.gap_rad;
        forward->flank_angle_rad = c->forward.flank_angle_rad;
      }
      if (c->backward.gap_rad < backward->gap_rad) {
        backward->gap_rad = c->backward.gap_rad;
        backward->flank_angle_rad = c->backward.flank_angle_rad;
      }
    }
  }
}

/* Of conjugate flanks many pairs touch first, and rounding decides which: the mean angle of the
 * pairs of a flank, each weighted by exp(-(gap beyond the nearest) / CLOSE_RAD). Chosen: pairs
 * further off than 0.2 arcmin, a third of the lost motion of catalogues at 4 % of rated torque,
 * hardly count. */
#define CLOSE_RAD (LM_PI / LM_REAL(216000)) /* 0.05 arcmin */
#define COUNTED_RAD (LM_REAL(20) * CLOSE_RAD)

typedef struct mean_angle {
  lm_real weight;
  lm_real sum;
} mean_angle;

static void add_angle(mean_angle *mean, const lm_gap *gap, lm_real nearest_rad) {
  if (gap->gap_rad - nearest_rad < COUNTED_RAD) {
    const lm_real weight = real_exp((nearest_rad - gap->gap_rad) / CLOSE_RAD);
    mean->weight += weight;
    mean->sum += weight * gap->flank_angle_rad;
  }
}

static void average_nearest(const lm_clearance clearances[], int count, lm_real limit_rad,
                            const nearest *forward, const nearest *backward,
                            mean_angle *forward_mean, mean_angle *backward_mean) {
  int i;
  for (i = 0; i < count; i++) {
    if (real_fabs(clearances[i].angle_rad) <= limit_rad + EDGE) {
      add_angle(forward_mean, &clearances[i].forward, forward->gap_rad);
      add_angle(backward_mean, &clearances[i].backward, backward->gap_rad);
    }
  }
}

/* State while the list of contacts is built. */
typedef struct builder {
  const lm_drive *drive;
  const lm_pair_give *give;
  lm_contact *contacts;
  int count;
  int lobes;
} builder;

/* Amount that the eccentricity of a fixed wave generator adds to the gap of a pair in one lobe and
 * subtracts in the other: the same displacement for all teeth, resolved along and across the radius
 * of each. sense: +1 where a lobe that moves outwards goes into mesh, -1 where it leaves it.
 */
static lm_real eccentric_shift(const lm_generator *g, lm_real sense, lm_real angle_rad,
                               const lm_gap *gap, int side) {
  const lm_real direction = g->eccentricity_angle_rad - angle_rad;
  return g->eccentricity_mm *
         (LM_REAL(side) * real_sin(direction) +
          sense * real_tan(gap->flank_angle_rad) * real_cos(direction)) /
         gap->radius_mm;
}

/* There is room for both flanks of every tooth of both lobes in all sections. */
static void add_pair(builder *b, const lm_mesh *mesh, int section, int tooth,
                     const lm_clearance *at, const lm_gap *gap, int side) {
  const lm_real c = real_cos(gap->flank_angle_rad);
  const lm_real give = give_at(b->give, mesh, at->foot_mm, gap->radius_mm) / (c * c);
  const lm_real shift = b->lobes == 2 ? eccentric_shift(&b->drive->generator, mesh->line.sense,
                                                        at->angle_rad, gap, side)
                                      : LM_REAL(0);
  int lobe;
  for (lobe = 0; lobe < b->lobes; lobe++) {
    lm_contact *contact = &b->contacts[b->count];
    contact->arm_mm = gap->radius_mm;
    contact->wedge = real_tan(gap->flank_angle_rad);
    contact->gap_rad = gap->gap_rad + (lobe == 0 ? shift : -shift);
    contact->compliance_mm_per_N = give * LM_REAL(b->drive->axial_sections);
    contact->tooth = tooth;
    contact->lobe = lobe;
    contact->section = section;
    contact->side = side;
    b->count++;
  }
}

/* Gaps that exceed the nearest one by least .. most. */
typedef struct gap_range {
  lm_real least_rad;
  lm_real most_rad;
} gap_range;

static int is_within(const lm_gap *gap, const nearest *of, const gap_range *range) {
  const lm_real beyond = gap->gap_rad - of->gap_rad;
  return beyond > range->least_rad && beyond <= range->most_rad;
}

static void add_section(builder *b, const lm_mesh *mesh, int section,
                        const lm_clearance clearances[], int count, const nearest *forward,
                        const nearest *backward, const gap_range *range) {
  int i;
  for (i = 0; i < count; i++) {
    const lm_clearance *c = &clearances[i];
    if (real_fabs(c->angle_rad) > b->drive->support.engagement_limit_rad + EDGE) {
      continue;
    }
    if (is_within(&c->forward, forward, range)) {
      add_pair(b, mesh, section, i, c, &c->forward, 1);
    }
    if (is_within(&c->backward, backward, range)) {
      add_pair(b, mesh, section, i, c, &c->backward, -1);
    }
  }
}

/* Rim between the axial sections: each turns by the torque that passes through it, counted from the
 * edge towards the cup. */
static void twist_between_sections(const lm_drive *drive, const lm_geometry *g,
                                   lm_foundation *foundation) {
  const int sections = drive->axial_sections;
  const lm_real inertia = LM_REAL(2) * LM_PI * g->neutral_mm * g->neutral_mm * g->neutral_mm *
                          drive->flexspline.rim_thickness_mm;
  int i;
  int j;
  for (i = 0; i < sections; i++) {
    for (j = 0; j < sections; j++) {
      foundation->twist_rad_per_Nmm[i][j] =
          sections == 1 ? LM_REAL(0)
                        : lm_section_place(i < j ? i : j, sections) * drive->teeth.face_width_mm /
                              (drive->material.shear_modulus_MPa * inertia);
    }
  }
}

lm_real lm_mean_radial_gap(const lm_drive *drive) {
  lm_real zone[LM_GAP_ZONES];
  int i;
  zone[LM_GENERATOR_GAP] = drive->gap.generator_mm;
  zone[LM_TEETH_GAP] = drive->gap.teeth_mm;
  for (i = 0; i < drive->tolerance_count; i++) {
    const lm_tolerance_link *link = &drive->tolerances[i];
    zone[link->zone] += link->influence * (link->lower_mm + link->upper_mm) / LM_REAL(2);
  }
  return larger(zone[LM_GENERATOR_GAP], LM_REAL(0)) + larger(zone[LM_TEETH_GAP], LM_REAL(0));
}

lm_status lm_prepare_meshes(const lm_drive *drive, int nodes, lm_design_workspace *workspace,
                            lm_fault *fault) {
  lm_status status = LM_OK;
  if (drive == 0 || workspace == 0) {
    return refuse(fault, LM_NULL, drive == 0 ? "drive" : "workspace");
  }
  workspace->give.known = 0;
  workspace->near_only = 0;
  status = check_range(fault, "drive.axial_sections", LM_REAL(drive->axial_sections), LM_REAL(1),
                       LM_REAL(LM_SECTIONS_MAX));
  if (status == LM_OK) {
    status = lm_make_face(drive, drive->axial_sections, nodes, workspace->meshes, fault);
  }
  return status;
}

/* The rim under the teeth of the contacts. */
static lm_status support_contacts(const lm_drive *drive, int pairs, lm_design_workspace *w,
                                  lm_fault *fault) {
  int first = w->contacts[0].tooth;
  int last = first;
  int i;
  for (i = 1; i < pairs; i++) {
    const int tooth = w->contacts[i].tooth;
    first = tooth < first ? tooth : first;
    last = tooth > last ? tooth : last;
  }
  return lm_make_rim_support(drive, &w->meshes[drive->axial_sections / 2], w->clearances[0], first,
                             last, &w->foundation, fault);
}

/* Contacts and foundation of the drive at a tooth phase. Pairs whose gap is wider than the nearest
 * one by more than support.gap_limit never carry; those wider by more than near_rad follow the
 * *near_count others. */
static lm_status build_contacts(const lm_drive *drive, lm_real phase_rad, lm_real near_rad,
                                int *near_count, lm_mesh_state *state, lm_design_workspace *w,
                                lm_fault *fault) {
  const lm_geometry *g = &w->meshes[0].geometry;
  const lm_real pitch = LM_REAL(2) * LM_PI / LM_REAL(g->flexspline_teeth);
  nearest forward = {REAL_INFINITY, LM_REAL(0)};
  nearest backward = {REAL_INFINITY, LM_REAL(0)};
  const lm_real limit = drive->support.gap_limit_rad;
  const gap_range near = {-REAL_INFINITY, near_rad < limit ? near_rad : limit};
  const gap_range far = {near.most_rad, limit};
  lm_least_gaps least = lm_no_gaps();
  builder b;
  lm_status status = w->give.known ? LM_OK : prepare_give(drive, &w->meshes[0], &w->give, fault);
  int count = 0;
  int i;
  w->give.known = status == LM_OK;
  b.drive = drive;
  b.give = &w->give;
  b.contacts = w->contacts;
  b.count = 0;
  b.lobes = drive->generator.floating || drive->generator.eccentricity_mm == LM_REAL(0) ? 1 : 2;
  for (i = 0; i < drive->axial_sections && status == LM_OK; i++) {
    status = lm_near_clearances(&w->meshes[i], phase_rad, near_rad, &least, w->clearances[i],
                                LM_LOBE_TEETH_MAX, &count, fault);
    find_nearest(w->clearances[i], count, drive->support.engagement_limit_rad, &forward, &backward);
  }
  if (status == LM_OK && !real_isfinite(forward.gap_rad + backward.gap_rad)) {
    status = refuse(fault, LM_NO_CONTACT, "teeth.engagement_depth");
  }
  for (i = 0; i < drive->axial_sections && status == LM_OK; i++) {
    add_section(&b, &w->meshes[i], i, w->clearances[i], count, &forward, &backward, &near);
  }
  *near_count = b.count;
  for (i = 0; i < drive->axial_sections && status == LM_OK; i++) {
    add_section(&b, &w->meshes[i], i, w->clearances[i], count, &forward, &backward, &far);
  }
  if (status == LM_OK) {
    w->foundation.supports = 0;
    status =
        drive->support.foundation_N_per_mm2 > LM_REAL(0)
            ? lm_beam_yield(drive->support.foundation_N_per_mm2,
                            drive->support.ring_stiffness_N_mm2, g->neutral_mm * pitch,
                            drive->support.ring_factor, count, w->foundation.yield_mm_per_N, fault)
            : support_contacts(drive, b.count, w, fault);
  }
  w->foundation.sections = drive->axial_sections;
  w->foundation.lobes = b.lobes;
  twist_between_sections(drive, g, &w->foundation);
  if (status == LM_OK && w->meshes[0].rigid_kind == LM_FLANK_CONJUGATE) {
    mean_angle ahead = {LM_REAL(0), LM_REAL(0)};
    mean_angle behind = {LM_REAL(0), LM_REAL(0)};
    for (i = 0; i < drive->axial_sections; i++) {
      average_nearest(w->clearances[i], count, drive->support.engagement_limit_rad, &forward,
                      &backward, &ahead, &behind);
    }
    forward.flank_angle_rad = ahead.sum / ahead.weight;
    backward.flank_angle_rad = behind.sum / behind.weight;
  }
  state->pairs = b.count;
  state->flank_angle_rad = (forward.flank_angle_rad + backward.flank_angle_rad) / LM_REAL(2);
  state->radius_mm = g->mean_mm;
  return status;
}

/* --- the sum ---------------------------------------------------------------------------------- */

/* One torque: all contributions besides the mesh, and the sum. */
static lm_status add_chains(const lm_drive *drive, const lm_mesh_state *state, lm_real gap_rad,
                            lm_real torsion_rad_per_Nm, const lm_take_up *mesh, lm_real torque_Nm,
                            lm_contributions *out, lm_fault *fault) {
  const lm_real tangent = real_tan(state->flank_angle_rad);
  const lm_real r = state->radius_mm;
  const lm_real sign = torque_Nm < LM_REAL(0) ? LM_REAL(-1) : LM_REAL(1);
  const lm_real rho = drive->friction_angle_rad;
  lm_real force = LM_REAL(0);
  lm_real approach = LM_REAL(0);
  lm_real slope = LM_REAL(0);
  lm_real gap = LM_REAL(0);
  lm_real compliance;
  lm_status status =
      lm_lobe_radial_force(torque_Nm, r, state->flank_angle_rad, LM_REAL(0), &force, fault);
  if (status == LM_OK) {
    status =
        lm_sum_radial(force, drive->radial_laws, drive->radial_law_count, &approach, &slope, fault);
  }
  if (status == LM_OK) {
    status = lm_gap_rotation(torque_Nm, state->gap_torque_Nm, gap_rad, &gap, fault);
  }
  if (status != LM_OK) {
    return status;
  }
  compliance = LM_REAL(1) / mesh->stiffness_Nm_per_rad + torsion_rad_per_Nm +
               slope * LM_MM_PER_M * tangent * tangent / (LM_REAL(2) * r * r);
  if (sign * torque_Nm < state->gap_torque_Nm) {
    compliance += gap_rad / state->gap_torque_Nm;
  }
  out->torque_Nm = torque_Nm;
  out->radial_gap_rad = gap;
  out->side_clearance_rad = mesh->clearance_rad;
  out->radial_compliance_rad = mesh->ring_rad + sign * approach * tangent / r;
  out->torsion_rad = torque_Nm * torsion_rad_per_Nm + mesh->twist_rad;
  out->tooth_bending_rad = mesh->tooth_rad;
  out->total_rad = out->radial_gap_rad + out->side_clearance_rad + out->radial_compliance_rad +
                   out->torsion_rad + out->tooth_bending_rad;
  out->stiffness_Nm_per_rad = LM_REAL(1) / compliance;
  out->friction_half_width_rad =
      real_fabs(out->radial_compliance_rad) *
      (real_tan(state->flank_angle_rad + rho) - real_tan(state->flank_angle_rad - rho)) /
      (LM_REAL(2) * tangent);
  out->forward_teeth = mesh->forward_teeth;
  out->backward_teeth = mesh->backward_teeth;
  return LM_OK;
}

/* Pairs whose gap exceeds the nearest one by more than this are left out at first, and by more than
 * this many times as much where one of them carries. Chosen for speed; the result does not depend on
 * them, because those of the mean angle are always exact. */
#define NEAR_RAD (LM_REAL(1.5) * COUNTED_RAD)
#define NEAR_GROWTH LM_REAL(4)

/* Whether every contact of a list has its exact gap. */
static int are_exact(const lm_design_workspace *w, const lm_contact contacts[], int count) {
  int i;
  for (i = 0; i < count; i++) {
    const lm_clearance *c = &w->clearances[contacts[i].section][contacts[i].tooth];
    if (contacts[i].side > 0 ? c->forward.is_bound : c->backward.is_bound) {
      return 0;
    }
  }
  return 1;
}

/* Contacts and their states under the torques. */
static lm_status take_up(const lm_drive *drive, lm_real phase_rad, const lm_real torque_Nm[],
                         int count, lm_mesh_state *found, lm_rest *rest, lm_design_workspace *w,
                         lm_fault *fault) {
  lm_real near_rad;
  int touched = 1;
  int near;
  lm_status status = LM_OK;
  for (near_rad = NEAR_RAD; w->near_only && touched && near_rad < drive->support.gap_limit_rad;
       near_rad *= NEAR_GROWTH) {
    status = build_contacts(drive, phase_rad, near_rad, &near, found, w, fault);
    if (status == LM_OK && are_exact(w, w->contacts, near) &&
        lm_near_take_up(w->contacts, near, found->pairs - near, &touched, &w->foundation, torque_Nm,
                        count, w->states, rest, &w->take_up, 0) != LM_OK) {
      touched = 1;
    }
  }
  if (touched) {
    status = build_contacts(drive, phase_rad, REAL_INFINITY, &near, found, w, fault);
    if (status == LM_OK) {
      status = lm_coupled_take_up(w->contacts, near, &w->foundation, torque_Nm, count, w->states,
                                  rest, &w->take_up, fault);
    }
  }
  return status;
}

lm_status lm_evaluate_torsion_curve(const lm_drive *drive, lm_real phase_rad,
                                    const lm_real torque_Nm[], int count,
                                    lm_contributions contributions[], lm_mesh_state *state,
                                    lm_design_workspace *workspace, lm_fault *fault) {
  lm_mesh_state found;
  lm_rest rest;
  lm_real gap_rad = LM_REAL(0);
  lm_real torsion = LM_REAL(0);
  lm_real unused = LM_REAL(0);
  lm_status status;
  int i;
  if (drive == 0 || torque_Nm == 0 || contributions == 0 || workspace == 0) {
    return refuse(fault, LM_NULL, "drive, torque_Nm, contributions, workspace");
  }
  status = check_range(fault, "count", LM_REAL(count), LM_REAL(1), LM_REAL(LM_TORQUES_MAX));
  if (status == LM_OK) {
    status = take_up(drive, phase_rad, torque_Nm, count, &found, &rest, workspace, fault);
  }
  if (status == LM_OK) {
    found.middle_rad = rest.middle_rad;
    found.free_play_rad = rest.free_play_rad;
    found.preloaded_pairs = rest.preloaded;
    found.gap_mm = lm_mean_radial_gap(drive);
    status =
        lm_radial_gap_angle(found.gap_mm, found.flank_angle_rad, found.radius_mm, &gap_rad, fault);
  }
  if (status == LM_OK) {
    status =
        lm_gap_closing_torque(found.gap_mm, found.radius_mm, drive->gap.ring_stiffness_N_per_mm,
                              found.flank_angle_rad, &found.gap_torque_Nm, fault);
  }
  if (status == LM_OK) {
    status =
        lm_sum_torsion(LM_REAL(0), drive->torsion, drive->torsion_count, &unused, &torsion, fault);
  }
  for (i = 0; i < count && status == LM_OK; i++) {
    status = add_chains(drive, &found, gap_rad, torsion, &workspace->states[i], torque_Nm[i],
                        &contributions[i], fault);
  }
  if (status == LM_OK && state != 0) {
    *state = found;
  }
  return status;
}

lm_status lm_reversal_lost_motion(const lm_drive *drive, lm_real phase_rad, lm_real torque_Nm,
                                  lm_real *lost_motion_rad, lm_design_workspace *workspace,
                                  lm_fault *fault) {
  lm_real torque[2];
  lm_contributions ends[2];
  lm_status status;
  if (lost_motion_rad == 0) {
    return refuse(fault, LM_NULL, "lost_motion_rad");
  }
  if (!(torque_Nm > LM_REAL(0))) {
    return refuse_range(fault, "torque_Nm", torque_Nm, LM_REAL(0), REAL_INFINITY);
  }
  torque[0] = -torque_Nm;
  torque[1] = torque_Nm;
  status = lm_evaluate_torsion_curve(drive, phase_rad, torque, 2, ends, 0, workspace, fault);
  if (status == LM_OK) {
    *lost_motion_rad = ends[1].total_rad - ends[0].total_rad;
  }
  return status;
}
