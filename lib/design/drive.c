#include "lostmotion/drive.h"

#include "lostmotion/design_key_list.h"
#include "lostmotion/flank.h"
#include "lostmotion/involute.h"
#include "lostmotion/load_capacity.h"
#include "lostmotion/mesh.h"
#include "lostmotion/radial_gap.h"
#include "lostmotion/shape.h"
#include "lostmotion/tooth_bending.h"
#include "real_math.h"
#include "refuse.h"
#include "runtime/plain_symbol.h"

#define DEGREE (LM_PI / LM_REAL(180))
#define ARCMIN (DEGREE / LM_REAL(60))

/* Units of the ranges of design_key_list.h. */
typedef struct key_scales {
  lm_real per_ONE;
  lm_real per_DEGREE;
  lm_real per_ARCMIN;
  lm_real per_MODULE;
  lm_real per_DIAMETER;
  lm_real per_RIM;
  lm_real per_FACE;
} key_scales;

static key_scales scales_of(const lm_drive *drive) {
  key_scales scales;
  scales.per_ONE = LM_REAL(1);
  scales.per_DEGREE = LM_PI / LM_REAL(180);
  scales.per_ARCMIN = LM_PI / LM_REAL(10800);
  scales.per_MODULE = drive->teeth.module_mm;
  scales.per_DIAMETER = drive->teeth.module_mm * LM_REAL(drive->teeth.flexspline_teeth);
  scales.per_RIM = drive->flexspline.rim_thickness_mm;
  scales.per_FACE = drive->teeth.face_width_mm;
  return scales;
}

/* The member of lm_drive that a row of the list names, as a number. */
#define NUMBER_REAL(value) (value)
#define NUMBER_COUNT(value) LM_REAL(value)
#define NUMBER_SWITCH(value) LM_REAL(value)
#define NUMBER_DEFORMATION(value) LM_REAL((int)(value))
#define NUMBER_FLANK(value) LM_REAL((int)(value))

/* A row as a bound. Dependent rows are checked where their range is known. */
#define BOUND(id, section, stem, suffix, kind, per, low, high, file, usual, vary, meaning) \
  {#section "." #stem #suffix, NUMBER_##kind(LM_OWNER_##section stem##suffix),             \
   LM_REAL(low) * scales.per_##per, LM_REAL(high) * scales.per_##per},
#define NO_BOUND(id, ...)

/* Each gear has its kinds. A shift outwards moves the conjugate flank of an internal gear further
 * into the mesh, and that of an external gear out of it. */
static lm_status check_flanks(const lm_teeth *t, lm_fault *fault) {
  const int own = (int)t->flexspline_flank;
  const int rigid = (int)t->rigid_flank;
  const int internal = t->deformation == LM_INTERNAL;
  const lm_real reach = t->engagement_depth - LM_REAL(0.1); /* of a conjugate flank, in modules */
  if (!lm_flank_fits(own, 0)) {
    return refuse_contradiction(fault, "teeth.flexspline_flank", LM_REAL(own), LM_REAL(0),
                                LM_REAL(LM_FLANK_POINTS));
  }
  if (!lm_flank_fits(rigid, 1)) {
    return refuse_contradiction(fault, "teeth.rigid_flank", LM_REAL(rigid), LM_REAL(0),
                                LM_REAL(LM_FLANK_POINTS));
  }
  if (rigid != LM_FLANK_INVOLUTE &&
      !(internal ? t->rigid_shift > -reach : t->rigid_shift < reach)) {
    return refuse_contradiction(fault, "teeth.rigid_shift", t->rigid_shift,
                                internal ? -reach : -REAL_INFINITY,
                                internal ? REAL_INFINITY : reach);
  }
  return LM_OK;
}

static lm_status check_teeth(const lm_drive *drive, lm_fault *fault) {
  const lm_teeth *t = &drive->teeth;
  const key_scales scales = scales_of(drive);
  const bound bounds[] = {LM_TEETH_KEYS(BOUND, NO_BOUND)};
  const lm_status status = check_bounds(fault, bounds, COUNT_OF(bounds));
  const int difference = t->deformation == LM_INTERNAL ? 2 : -2;
  if (status != LM_OK) {
    return status;
  }
  if (t->flexspline_teeth % 2 != 0) {
    return refuse_contradiction(fault, "teeth.flexspline_teeth", LM_REAL(t->flexspline_teeth),
                                LM_REAL(t->flexspline_teeth - 1), LM_REAL(t->flexspline_teeth + 1));
  }
  if (t->rigid_teeth != t->flexspline_teeth + difference) {
    return refuse_contradiction(fault, "teeth.rigid_teeth", LM_REAL(t->rigid_teeth),
                                LM_REAL(t->flexspline_teeth + difference),
                                LM_REAL(t->flexspline_teeth + difference));
  }
  return check_flanks(t, fault);
}

static lm_status check_generator(const lm_drive *drive, lm_fault *fault) {
  const lm_generator *g = &drive->generator;
  const int external = drive->teeth.deformation == LM_EXTERNAL;
  const key_scales scales = scales_of(drive);
  const bound bounds[] = {LM_GENERATOR_KEYS(BOUND, NO_BOUND)};
  lm_shape shape;
  lm_status status = lm_make_shape(g->type, g->contact_half_angle_rad, &shape, fault);
  if (status == LM_OK) {
    status = check_bounds(fault, bounds, COUNT_OF(bounds));
  }
  if (status == LM_OK && (g->type == LM_RING) != external) {
    status = refuse_contradiction(fault, "generator.type", LM_REAL((int)g->type),
                                  LM_REAL(external ? LM_RING : LM_COSINE),
                                  LM_REAL(external ? LM_RING : LM_ROLLERS));
  }
  return status;
}

/* The output is the flexspline with the rigid gear fixed, or the other way round: |u| = z / 2 of
 * the gear that is the output. */
static lm_status check_ratio(const lm_drive *d, lm_fault *fault) {
  const lm_real u = real_fabs(d->ratio);
  const lm_real flexspline = LM_REAL(d->teeth.flexspline_teeth) / LM_REAL(2);
  const lm_real rigid = LM_REAL(d->teeth.rigid_teeth) / LM_REAL(2);
  if (!(u >= LM_REAL(1) && u <= LM_REAL(1000))) {
    return refuse_range(fault, "drive.ratio", d->ratio, LM_REAL(1), LM_REAL(1000));
  }
  if (real_fabs(u - flexspline) > LM_REAL(1e-3) && real_fabs(u - rigid) > LM_REAL(1e-3)) {
    return refuse_contradiction(fault, "drive.ratio", d->ratio,
                                flexspline < rigid ? flexspline : rigid,
                                flexspline < rigid ? rigid : flexspline);
  }
  return LM_OK;
}

/* Inputs that lm_complete_drive requires. */
static lm_status check_given(const lm_drive *d, lm_fault *fault) {
  lm_status status = check_teeth(d, fault);
  if (status == LM_OK) {
    status = check_generator(d, fault);
  }
  if (status == LM_OK) {
    status = check_ratio(d, fault);
  }
  if (status == LM_OK) {
    status = check_range(fault, "drive.rated_torque_Nm", d->rated_torque_Nm, LM_REAL(1e-4),
                         LM_REAL(1e6));
  }
  return status;
}

lm_status lm_check_drive(const lm_drive *drive, lm_fault *fault) {
  lm_geometry geometry;
  lm_neutral_line line;
  lm_status status;
  if (drive == 0) {
    return refuse(fault, LM_NULL, "drive");
  }
  status = check_given(drive, fault);
  if (status == LM_OK) {
    const key_scales scales = scales_of(drive);
    const bound bounds[] = {
        {"radial_chain", LM_REAL(drive->radial_law_count), LM_REAL(0), LM_REAL(LM_RADIAL_LAWS_MAX)},
        {"torsion_chain", LM_REAL(drive->torsion_count), LM_REAL(0),
         LM_REAL(LM_TORSION_ELEMENTS_MAX)},
        {"tolerance", LM_REAL(drive->tolerance_count), LM_REAL(0), LM_REAL(LM_TOLERANCE_LINKS_MAX)},
        /* clang-format off */
        LM_FLEXSPLINE_KEYS(BOUND, NO_BOUND)
        LM_MATERIAL_KEYS(BOUND, NO_BOUND)
        LM_SUPPORT_KEYS(BOUND, NO_BOUND)
        LM_GAP_KEYS(BOUND, NO_BOUND)
        LM_FLANK_KEYS(BOUND, NO_BOUND)
        LM_DRIVE_KEYS(BOUND, NO_BOUND)
        /* clang-format on */
    };
    status = check_bounds(fault, bounds, COUNT_OF(bounds));
  }
  if (status == LM_OK) {
    status = lm_check_radial_laws(drive->radial_laws, drive->radial_law_count, fault);
  }
  if (status == LM_OK) {
    status = lm_check_torsion_elements(drive->torsion, drive->torsion_count, fault);
  }
  if (status == LM_OK) {
    status = lm_check_tolerance_links(drive->tolerances, drive->tolerance_count, fault);
  }
  if (status == LM_OK) {
    status = lm_make_geometry(&drive->teeth, drive->generator.deflection_mm,
                              drive->flexspline.rim_thickness_mm, &geometry, fault);
  }
  if (status == LM_OK && drive->planar_only && drive->axial_sections > 1) {
    status = refuse_contradiction(fault, "planar_only", LM_REAL(1), LM_REAL(0), LM_REAL(0));
  }
  if (status == LM_OK) {
    lm_geometry deepest = geometry;
    lm_flank flank;
    lm_deepen_root(drive, lm_face_places(drive), &deepest);
    status = lm_make_flank(drive, &deepest, 1, &flank, fault);
  }
  /* A neutral line of few nodes in the widest axial section shows whether there is one. */
  if (status == LM_OK) {
    const int sections = drive->axial_sections;
    status = lm_make_neutral_line(
        &drive->generator, drive->teeth.deformation, geometry.neutral_mm,
        drive->generator.deflection_mm * lm_section_factor(drive, sections - 1, sections), 8, &line,
        fault);
  }
  return status;
}
PLAIN_SYMBOL(lm_check_drive, LM_PRECISION_TEXT)

static void fill(lm_real *value, lm_real otherwise) {
  if (*value == LM_REAL(0)) {
    *value = otherwise;
  }
}

/* Length of the cup; at most 20 face widths, the limit for a drive. */
static lm_real usual_length(lm_real diameter_mm, lm_real face_width_mm) {
  const lm_real least = LM_REAL(2) * face_width_mm;
  const lm_real most = LM_REAL(20) * face_width_mm;
  const lm_real usual = LM_REAL(0.45) * diameter_mm;
  if (usual < least) {
    return least;
  }
  return usual > most ? most : usual;
}

static void fill_material(lm_material *material) {
  fill(&material->youngs_modulus_MPa, LM_REAL(LM_STEEL_YOUNGS_MODULUS_MPA));
  fill(&material->poisson_ratio, LM_REAL(LM_STEEL_POISSON_RATIO));
  /* G = E / (2 (1 + nu)) of any material, in proportion to steel's own figures. */
  fill(&material->shear_modulus_MPa,
       LM_REAL(LM_STEEL_SHEAR_MODULUS_MPA) *
           (material->youngs_modulus_MPa / LM_REAL(LM_STEEL_YOUNGS_MODULUS_MPA)) *
           ((LM_REAL(1) + LM_REAL(LM_STEEL_POISSON_RATIO)) /
            (LM_REAL(1) + material->poisson_ratio)));
  fill(&material->bending_fatigue_MPa, LM_REAL(450));
  fill(&material->shear_fatigue_MPa, LM_REAL(250));
  fill(&material->bending_notch_factor, LM_REAL(1.9));
  fill(&material->shear_notch_factor, LM_REAL(1.5));
  fill(&material->mean_stress_factor, LM_REAL(0.1));
  fill(&material->flank_pressure_MPa, LM_REAL(240));
  fill(&material->tooth_stress_factor, LM_REAL(1.45));
}

/* The flexible bearing of size 20: 23 balls of 4 mm (theory/check_values.md), whose pitch and
 * stiffness give k_f = 2600 N/mm^2 at 30 N; its outer race is about 1.1 mm thick. */
#define BALLS 23
#define BALL_DIAMETER LM_REAL(0.08)
#define RACE_THICKNESS LM_REAL(0.022)

/* Rollers run in a backing ring, chosen: it spans 60 deg between them, and a thinner one lets
 * textbook drives of catalogue ratings ratchet. */
#define BACKING_RING LM_REAL(0.075)

static void fill_support(lm_drive *drive, lm_real diameter_mm) {
  const lm_real rim = drive->flexspline.rim_thickness_mm;
  lm_support *support = &drive->support;
  const lm_generator *g = &drive->generator;
  const lm_real beyond = LM_REAL(25) * DEGREE;
  const int arc = g->type != LM_COSINE && g->type != LM_ELLIPSE;
  support->balls = support->balls == 0 ? BALLS : support->balls;
  fill(&support->ball_diameter_mm, BALL_DIAMETER * diameter_mm);
  fill(&support->race_thickness_mm,
       (g->type == LM_ROLLERS ? BACKING_RING : RACE_THICKNESS) * diameter_mm);
  fill(&support->bearing_rating_N,
       lm_ball_bearing_rating(support->balls, support->ball_diameter_mm));
  fill(&support->ring_stiffness_N_mm2,
       drive->material.youngs_modulus_MPa * drive->teeth.face_width_mm *
           (rim * rim * rim +
            support->race_thickness_mm * support->race_thickness_mm * support->race_thickness_mm) /
           LM_REAL(12));
  fill(&drive->support.ring_factor, LM_REAL(1));
  fill(&drive->support.engagement_limit_rad,
       arc ? g->contact_half_angle_rad + beyond : LM_REAL(70) * DEGREE);
  if (drive->support.engagement_limit_rad > LM_PI / LM_REAL(2)) {
    drive->support.engagement_limit_rad = LM_PI / LM_REAL(2);
  }
  fill(&drive->support.gap_limit_rad, LM_REAL(8) * ARCMIN);
}

/* The circular spline between its teeth and the housing. */
static lm_status fill_radial_chain(lm_drive *drive, lm_real diameter_mm, lm_fault *fault) {
  const lm_real thickness = LM_RING_SHARE * diameter_mm;
  const lm_generator *g = &drive->generator;
  const int arc = g->type != LM_COSINE && g->type != LM_ELLIPSE;
  const lm_real patch = arc ? g->contact_half_angle_rad : LM_REAL(30) * DEGREE;
  if (drive->radial_law_count != 0) {
    return LM_OK;
  }
  drive->radial_law_count = 1;
  return lm_make_rim_ovalisation_law(
      (diameter_mm + thickness) / LM_REAL(2), thickness, drive->teeth.face_width_mm, patch,
      drive->material.youngs_modulus_MPa, LM_REAL(3), &drive->radial_laws[0], fault);
}

static lm_status fill_torsion_chain(lm_drive *drive, lm_real diameter_mm, lm_fault *fault) {
  const lm_real radius = diameter_mm / LM_REAL(2);
  const lm_real wall = drive->flexspline.wall_thickness_mm;
  const lm_real shear = drive->material.shear_modulus_MPa;
  /* The rim between axial sections twists in the mesh, from its inner edge on: the wall
   * ends there. */
  const lm_real rim =
      drive->axial_sections > 1 ? drive->teeth.face_width_mm / LM_REAL(2) : LM_REAL(0);
  lm_status status;
  if (drive->torsion_count != 0) {
    return LM_OK;
  }
  drive->torsion_count = 4;
  status = lm_make_shell_torsion(radius, wall, drive->flexspline.length_mm - rim, shear,
                                 &drive->torsion[0], fault);
  if (status == LM_OK) {
    status = lm_make_diaphragm_torsion(LM_REAL(0.3) * diameter_mm, radius, LM_REAL(1.5) * wall,
                                       shear, &drive->torsion[1], fault);
  }
  if (status == LM_OK) {
    status =
        lm_make_shaft_torsion(LM_REAL(0.16) * diameter_mm, LM_REAL(0), LM_REAL(0.6) * diameter_mm,
                              shear, drive->ratio, &drive->torsion[2], fault);
  }
  if (status == LM_OK) {
    status =
        lm_make_shaft_torsion(LM_REAL(0.5) * diameter_mm, LM_REAL(0), LM_REAL(0.8) * diameter_mm,
                              shear, LM_REAL(1), &drive->torsion[3], fault);
  }
  return status;
}

lm_status lm_complete_drive(lm_drive *drive, lm_fault *fault) {
  lm_drive filled;
  lm_status status;
  lm_real diameter;
  if (drive == 0) {
    return refuse(fault, LM_NULL, "drive");
  }
  status = check_given(drive, fault);
  if (status != LM_OK) {
    return status;
  }
  filled = *drive;
  diameter = filled.teeth.module_mm * LM_REAL(filled.teeth.flexspline_teeth);
  fill(&filled.flexspline.rim_thickness_mm,
       (LM_REAL(65) + LM_REAL(2.5) * real_pow(real_fabs(filled.ratio), LM_REAL(2) / LM_REAL(3))) *
           LM_REAL(1e-4) * diameter);
  fill(&filled.flexspline.wall_thickness_mm, LM_REAL(0.6) * filled.flexspline.rim_thickness_mm);
  fill(&filled.flexspline.length_mm, usual_length(diameter, filled.teeth.face_width_mm));
  fill_material(&filled.material);
  fill_support(&filled, diameter);
  filled.axial_sections = filled.axial_sections == 0 ? 1 : filled.axial_sections;
  if (filled.gap.ring_stiffness_N_per_mm == LM_REAL(0)) {
    status = lm_ring_stiffness(diameter / LM_REAL(2), filled.flexspline.rim_thickness_mm,
                               filled.teeth.face_width_mm, filled.material.youngs_modulus_MPa,
                               LM_REAL(2), &filled.gap.ring_stiffness_N_per_mm, fault);
  }
  if (status == LM_OK) {
    status = fill_radial_chain(&filled, diameter, fault);
  }
  if (status == LM_OK) {
    status = fill_torsion_chain(&filled, diameter, fault);
  }
  if (status == LM_OK) {
    *drive = filled;
  }
  return status;
}
PLAIN_SYMBOL(lm_complete_drive, LM_PRECISION_TEXT)
