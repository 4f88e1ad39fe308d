#include "lostmotion/load_capacity.h"
#include "lostmotion/tooth_outline.h"

#include "real_math.h"
#include "refuse.h"

/* NASA SP-8007: coefficient of the moderately long cylinder, and the correlation factor for
 * torsion. */
#define BUCKLING_COEFFICIENT LM_REAL(0.747)
#define BUCKLING_CORRELATION LM_REAL(0.67)

/* The cup as lm_complete_drive draws it: hub over wall radius, diaphragm over wall thickness. */
#define HUB_RADIUS LM_REAL(0.6)
#define DIAPHRAGM_THICKNESS LM_REAL(1.5)

/* ISO 281. */
#define RATING_FACTOR LM_REAL(1.3)
#define GEOMETRY_FACTOR LM_REAL(54)

/* Load of the wave generator's bearing, Vestnik of BMSTU, article 1072, equation (34): the factor
 * of the radial force, and the dynamic factor (1.3 .. 1.5). */
#define BEARING_SHARE LM_REAL(0.65)
#define BEARING_DYNAMIC LM_REAL(1.3)

static lm_real larger(lm_real a, lm_real b) {
  return a > b ? a : b;
}

/* Tangential force on a pair in the last reported state. */
static lm_real force_of(const lm_design_workspace *w, int place) {
  const lm_take_up_workspace *t = &w->take_up;
  return t->rest_force[t->active[place]] + t->change[place];
}

/* One tooth at its root; `outline`, unless null, has the sections above it. */
typedef struct root {
  lm_real radius_mm; /* where the flank ends */
  lm_real thickness_mm;
  const lm_tooth_outline *outline;
} root;

static root root_of(const lm_involute *flank, lm_real root_mm, lm_real pitch_half_rad) {
  const lm_real radius = root_mm > flank->base_mm ? root_mm : flank->base_mm;
  const lm_real half = lm_evaluate_involute(flank, radius).half_angle_rad;
  root found;
  found.radius_mm = radius;
  found.thickness_mm =
      LM_REAL(2) * radius * (pitch_half_rad > LM_REAL(0) ? pitch_half_rad - half : half);
  found.outline = 0;
  return found;
}

static root drawn_root(const lm_drive *drive, const lm_mesh *mesh, int rigid,
                       lm_tooth_outline *outline) {
  root found;
  lm_make_tooth_outline(drive, mesh, rigid, outline);
  found.radius_mm = outline->root_mm;
  found.thickness_mm = LM_REAL(2) * lm_outline_flank(outline, LM_REAL(0)).half_mm;
  found.outline = outline;
  return found;
}

/* Lever arm of a force on the flank about the section at the root, or the arm that causes the same
 * stress there as in the section of the largest stress. */
static lm_real lever_of(const root *at, lm_real load_mm) {
  const lm_real height = real_fabs(load_mm - at->radius_mm);
  return at->outline == 0
             ? height
             : at->thickness_mm * at->thickness_mm * lm_outline_leverage(at->outline, height);
}

/* Values common to all pairs. */
typedef struct teeth {
  root flexspline;
  root rigid;
  lm_tooth_outline outlines[2]; /* of the flexspline's tooth and the rigid one */
  lm_real width_mm;
  lm_real depth_mm; /* engagement on the deformation axis */
} teeth;

static void prepare_teeth(const lm_drive *drive, const lm_mesh *mesh, teeth *t) {
  const lm_geometry *g = &mesh->geometry;
  const int internal = g->deformation == LM_INTERNAL;
  t->flexspline = mesh->flank.kind != LM_FLANK_INVOLUTE
                      ? drawn_root(drive, mesh, 0, &t->outlines[0])
                      : root_of(&g->flexspline, g->flexspline_root_mm,
                                internal ? LM_REAL(0) : LM_PI / LM_REAL(g->flexspline_teeth));
  t->rigid = mesh->rigid_kind != LM_FLANK_INVOLUTE
                 ? drawn_root(drive, mesh, 1, &t->outlines[1])
                 : root_of(&g->rigid, g->rigid_root_mm,
                           internal ? LM_PI / LM_REAL(g->rigid_teeth) : LM_REAL(0));
  t->width_mm = drive->teeth.face_width_mm;
  t->depth_mm = drive->teeth.engagement_depth * g->module_mm;
}

/* Stress of the teeth of a pair from its force. */
typedef struct effect {
  lm_real normal_N;
  lm_real flexspline_Nmm; /* moments about the roots */
  lm_real rigid_Nmm;
  lm_real depth_mm; /* engaged there */
} effect;

static effect effect_of(const lm_design_workspace *w, const teeth *t, int place) {
  const lm_contact *pair = &w->contacts[w->take_up.active[place]];
  const lm_mesh *mesh = &w->meshes[pair->section];
  const lm_geometry *g = &mesh->geometry;
  const lm_real foot = w->clearances[pair->section][pair->tooth].foot_mm;
  const lm_real force = force_of(w, place);
  const lm_real own_mm = pair->arm_mm - foot + g->neutral_mm;
  const lm_real tip = foot + g->flexspline_tip_mm - g->neutral_mm;
  effect found;
  found.normal_N = force * real_sqrt(LM_REAL(1) + pair->wedge * pair->wedge);
  found.flexspline_Nmm = force * lever_of(&t->flexspline, own_mm);
  found.rigid_Nmm = force * lever_of(&t->rigid, pair->arm_mm);
  found.depth_mm = mesh->line.sense * (tip - g->rigid_tip_mm);
  return found;
}

/* Load of one tooth over all sections: the stress is that of the whole face, so that it does not
 * depend on the number of sections. */
static void add_tooth(const lm_design_workspace *w, const teeth *t, const effect effects[],
                      int place, lm_load *load) {
  const lm_contact *of = &w->contacts[w->take_up.active[place]];
  lm_real normal = LM_REAL(0);
  lm_real flexspline = LM_REAL(0);
  lm_real rigid = LM_REAL(0);
  int i;
  for (i = 0; i < w->take_up.active_count; i++) {
    const lm_contact *pair = &w->contacts[w->take_up.active[i]];
    if (pair->tooth == of->tooth && pair->side == of->side && pair->lobe == of->lobe) {
      normal += effects[i].normal_N;
      flexspline += effects[i].flexspline_Nmm;
      rigid += effects[i].rigid_Nmm;
    }
  }
  load->largest_force_N = larger(load->largest_force_N, normal);
  load->flank_pressure_MPa = larger(load->flank_pressure_MPa, normal / (t->width_mm * t->depth_mm));
  load->flexspline_root_MPa =
      larger(load->flexspline_root_MPa,
             LM_REAL(6) * flexspline /
                 (t->width_mm * t->flexspline.thickness_mm * t->flexspline.thickness_mm));
  load->rigid_root_MPa =
      larger(load->rigid_root_MPa,
             LM_REAL(6) * rigid / (t->width_mm * t->rigid.thickness_mm * t->rigid.thickness_mm));
}

/* The lobe with the larger displacement; a fixed, eccentric wave generator may load only
 * one lobe. */
static int loaded_lobe(const lm_design_workspace *w) {
  lm_real first = LM_REAL(0);
  lm_real second = LM_REAL(0);
  int i;
  for (i = 0; i < w->take_up.active_count; i++) {
    const lm_contact *pair = &w->contacts[w->take_up.active[i]];
    if (pair->lobe == 0) {
      first += pair->wedge * force_of(w, i);
    } else {
      second += pair->wedge * force_of(w, i);
    }
  }
  return second > first;
}

/* Largest share of one axial section in the normal forces of a lobe. */
static lm_real section_share(const lm_design_workspace *w, const effect effects[], int lobe) {
  lm_real normal[LM_SECTIONS_MAX] = {LM_REAL(0)};
  lm_real sum = LM_REAL(0);
  lm_real largest = LM_REAL(0);
  int i;
  for (i = 0; i < w->take_up.active_count; i++) {
    const lm_contact *pair = &w->contacts[w->take_up.active[i]];
    if (pair->lobe == lobe) {
      normal[pair->section] += effects[i].normal_N;
      sum += effects[i].normal_N;
    }
  }
  for (i = 0; i < LM_SECTIONS_MAX; i++) {
    largest = larger(largest, normal[i]);
  }
  return largest / sum;
}

lm_status lm_measure_load(const lm_drive *drive, lm_real torque_Nm, const lm_design_workspace *w,
                          lm_load *load, lm_fault *fault) {
  effect effects[LM_ACTIVE_MAX];
  lm_load found;
  lm_real tangential = LM_REAL(0); /* sums over the lobe with the higher load */
  lm_real normal = LM_REAL(0);
  lm_real work = LM_REAL(0);
  lm_real depth = LM_REAL(0);
  lm_real approach = LM_REAL(0);
  lm_real slope = LM_REAL(0);
  lm_status status;
  teeth t;
  int lobe;
  int i;
  int j;
  if (drive == 0 || w == 0 || load == 0) {
    return refuse(fault, LM_NULL, "drive, workspace, load");
  }
  if (!(torque_Nm > LM_REAL(0))) {
    return refuse_range(fault, "torque_Nm", torque_Nm, LM_REAL(0), REAL_INFINITY);
  }
  if (w->take_up.active_count == 0) {
    return refuse(fault, LM_NO_CONTACT, "teeth.engagement_depth");
  }
  prepare_teeth(drive, &w->meshes[0], &t);
  lobe = loaded_lobe(w);
  found.torque_Nm = torque_Nm;
  found.largest_force_N = LM_REAL(0);
  found.flank_pressure_MPa = LM_REAL(0);
  found.flexspline_root_MPa = LM_REAL(0);
  found.rigid_root_MPa = LM_REAL(0);
  found.radial_force_N = LM_REAL(0);
  for (i = 0; i < w->take_up.active_count; i++) {
    effects[i] = effect_of(w, &t, i);
  }
  for (i = 0; i < w->take_up.active_count; i++) {
    const lm_contact *pair = &w->contacts[w->take_up.active[i]];
    const lm_real force = force_of(w, i);
    const lm_real radial = pair->wedge * force;
    add_tooth(w, &t, effects, i, &found);
    if (pair->lobe != lobe) {
      continue;
    }
    tangential += force;
    normal += effects[i].normal_N;
    found.radial_force_N += radial;
    depth += radial * effects[i].depth_mm;
    for (j = 0; j < w->take_up.active_count; j++) {
      const lm_contact *other = &w->contacts[w->take_up.active[j]];
      if (other->lobe == lobe) {
        work += radial * other->wedge * force_of(w, j) *
                lm_rim_yield(&w->foundation, pair->tooth, other->tooth);
      }
    }
  }
  if (!(found.radial_force_N > LM_REAL(0))) {
    return refuse(fault, LM_NO_CONTACT, "teeth.engagement_depth");
  }
  status = lm_sum_radial(found.radial_force_N, drive->radial_laws, drive->radial_law_count,
                         &approach, &slope, fault);
  if (status != LM_OK) {
    return status;
  }
  found.largest_share = found.largest_force_N / normal;
  found.section_share = section_share(w, effects, lobe);
  found.wedge = found.radial_force_N / tangential;
  found.deflection_mm = work / found.radial_force_N + approach;
  found.depth_mm = depth / found.radial_force_N;
  found.ratcheting_torque_Nm = torque_Nm * found.depth_mm / found.deflection_mm;
  *load = found;
  return LM_OK;
}

void lm_keep_worst_load(const lm_load *load, int first, lm_load *worst) {
  if (first) {
    *worst = *load;
    return;
  }
  worst->largest_force_N = larger(worst->largest_force_N, load->largest_force_N);
  worst->largest_share = larger(worst->largest_share, load->largest_share);
  worst->section_share = larger(worst->section_share, load->section_share);
  worst->flank_pressure_MPa = larger(worst->flank_pressure_MPa, load->flank_pressure_MPa);
  worst->flexspline_root_MPa = larger(worst->flexspline_root_MPa, load->flexspline_root_MPa);
  worst->rigid_root_MPa = larger(worst->rigid_root_MPa, load->rigid_root_MPa);
  worst->radial_force_N = larger(worst->radial_force_N, load->radial_force_N);
  worst->wedge = larger(worst->wedge, load->wedge);
  if (load->ratcheting_torque_Nm < worst->ratcheting_torque_Nm) {
    worst->ratcheting_torque_Nm = load->ratcheting_torque_Nm;
    worst->deflection_mm = load->deflection_mm;
    worst->depth_mm = load->depth_mm;
  }
}

lm_status lm_find_rated_load(const lm_drive *drive, int phases, lm_design_workspace *workspace,
                             lm_load *load, lm_fault *fault) {
  lm_drive along; /* the face: the pairs at its edges take part */
  lm_status status;
  int p;
  if (drive == 0 || workspace == 0 || load == 0) {
    return refuse(fault, LM_NULL, "drive, workspace, load");
  }
  along = *drive;
  along.axial_sections = lm_face_sections(drive);
  status = check_range(fault, "phases", LM_REAL(phases), LM_REAL(1), LM_REAL(LM_SWEEP_PHASES_MAX));
  if (status == LM_OK) {
    status = lm_prepare_meshes(&along, LM_NEUTRAL_LINE_NODES, workspace, fault);
  }
  for (p = 0; p < phases && status == LM_OK; p++) {
    const lm_real phase =
        LM_REAL(2) * LM_PI * LM_REAL(p) / LM_REAL(drive->teeth.flexspline_teeth * phases);
    lm_contributions at;
    lm_load here;
    status = lm_evaluate_torsion_curve(&along, phase, &along.rated_torque_Nm, 1, &at, 0, workspace,
                                       fault);
    if (status == LM_OK) {
      status = lm_measure_load(&along, drive->rated_torque_Nm, workspace, &here, fault);
    }
    if (status == LM_OK) {
      lm_keep_worst_load(&here, p == 0, load);
    }
  }
  return status;
}

/* --- the cup ---------------------------------------------------------------------------------- */

lm_real lm_cup_buckling_torque(const lm_drive *drive, lm_real radius_mm) {
  const lm_flexspline *cup = &drive->flexspline;
  /* Free between the diaphragm and the inner edge of the rim. */
  const lm_real length = cup->length_mm - drive->teeth.face_width_mm / LM_REAL(2);
  const lm_real slender = cup->wall_thickness_mm / radius_mm;
  const lm_real shear = BUCKLING_COEFFICIENT * BUCKLING_CORRELATION *
                        drive->material.youngs_modulus_MPa * slender *
                        real_sqrt(real_sqrt(slender)) * real_sqrt(radius_mm / length);
  return LM_REAL(2) * LM_PI * radius_mm * radius_mm * cup->wall_thickness_mm * shear / LM_MM_PER_M;
}

lm_real lm_coning_stress(const lm_drive *drive, lm_real radius_mm) {
  const lm_material *steel = &drive->material;
  const lm_real wall = drive->flexspline.wall_thickness_mm;
  const lm_real thickness = DIAPHRAGM_THICKNESS * wall;
  const lm_real strip = (LM_REAL(1) - HUB_RADIUS) * radius_mm;
  const lm_real slope = drive->generator.deflection_mm / drive->flexspline.length_mm;
  const lm_real rigidity =
      steel->youngs_modulus_MPa * thickness * thickness * thickness /
      (LM_REAL(12) * (LM_REAL(1) - steel->poisson_ratio * steel->poisson_ratio));
  /* The end of the strip shifts by r slope / 4 while it turns by the slope. */
  const lm_real shift = radius_mm / (LM_REAL(4) * strip);
  const lm_real corner = real_fabs(LM_REAL(4) - LM_REAL(6) * shift) * rigidity * slope / strip;
  const lm_real hub = real_fabs(LM_REAL(2) - LM_REAL(6) * shift) * rigidity * slope / strip;
  return larger(LM_REAL(6) * corner / (wall * wall), LM_REAL(6) * hub / (thickness * thickness));
}

/* --- the wave generator
 * -------------------------------------------------------------------------------
 */

lm_real lm_ball_bearing_rating(int balls, lm_real ball_diameter_mm) {
  return RATING_FACTOR * GEOMETRY_FACTOR * real_pow(LM_REAL(balls), LM_REAL(2) / LM_REAL(3)) *
         real_pow(ball_diameter_mm, LM_REAL(1.8));
}

lm_real lm_bearing_life(const lm_drive *drive, const lm_load *load, lm_real speed_rpm) {
  const lm_real radius =
      drive->teeth.module_mm * LM_REAL(drive->teeth.flexspline_teeth) / LM_REAL(2);
  const lm_real force =
      BEARING_SHARE * BEARING_DYNAMIC * LM_MM_PER_M * load->torque_Nm * load->wedge / radius;
  const lm_real ratio = drive->support.bearing_rating_N / force;
  return LM_REAL(1e6) / (LM_REAL(60) * speed_rpm) * ratio * ratio * ratio;
}
