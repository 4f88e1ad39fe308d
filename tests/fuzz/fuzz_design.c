/* libFuzzer: for any drive, the design model either refuses it and writes nothing, or gives
 * clearances and a take-up as documented in the headers.
 *
 *   clang -g -O1 -fsanitize=fuzzer,address,undefined -ffp-contract=off -Ilib/include -Ilib
 *     tests/fuzz/fuzz_design.c lib/status.c lib/design/{drive,shape,involute,mesh,takeup}.c
 *     lib/design/{radial_chain,radial_gap,tooth_bending,torsion_chain,tolerance}.c -lm
 *     -o fuzz_design
 *
 * With -DLM_REAL_BITS=32 the same in float32.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "fuzz_input.h"
#include "lostmotion/drive.h"
#include "lostmotion/mesh.h"
#include "lostmotion/takeup.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define FUZZED_CONTACTS 24
#define FUZZED_TORQUES 9

/* Relative rounding error of an angle. */
#define ROUNDING ((lm_real)(LM_REAL_BITS == 64 ? 1e-9 : 1e-3))

/* A number between two limits; *wild: any bit pattern instead. */
static lm_real take_real(fuzz_input *input, double low, double high, int *wild) {
  uint16_t part;
  lm_real any;
  if (take_byte(input) > 249) {
    take(input, &any, sizeof(any));
    *wild = 1;
    return any;
  }
  take(input, &part, sizeof(part));
  return (lm_real)(low + (high - low) * part / 65535.0);
}

/* --- drives --- */

static void take_drive(fuzz_input *input, lm_drive *drive) {
  const uint8_t choice = take_byte(input);
  const int external = choice % 4 == 3;
  int wild = 0;
  double m;
  memset(drive, 0, sizeof(*drive));
  drive->teeth.deformation = external ? LM_EXTERNAL : LM_INTERNAL;
  drive->teeth.flexspline_teeth = 30 + 2 * (take_byte(input) + take_byte(input) % 32);
  drive->teeth.rigid_teeth = drive->teeth.flexspline_teeth + (external ? -2 : 2);
  drive->ratio = (lm_real)drive->teeth.flexspline_teeth / 2;
  drive->rated_torque_Nm = take_real(input, 1, 1000, &wild);
  drive->teeth.module_mm = take_real(input, 0.05, 10, &wild);
  m = (double)drive->teeth.module_mm;
  drive->teeth.pressure_angle_rad = take_real(input, 0.175, 0.61, &wild);
  drive->teeth.flexspline_shift = take_real(input, -2, 12, &wild);
  drive->teeth.rigid_shift =
      choice & 64 ? take_real(input, -2, 12, &wild)
                  : drive->teeth.flexspline_shift + take_real(input, -0.5, 0.5, &wild);
  drive->teeth.rack_addendum = take_real(input, 0.5, 1.5, &wild);
  drive->teeth.root_clearance = take_real(input, 0.05, 0.6, &wild);
  drive->teeth.tooth_height = take_real(input, 0.5, 3, &wild);
  drive->teeth.engagement_depth = take_real(input, 0.2, 2.5, &wild);
  drive->teeth.face_width_mm = take_real(input, 0.5, 400, &wild);
  drive->generator.type = external ? LM_RING : (lm_generator_type)(take_byte(input) % 4);
  drive->generator.deflection_mm = take_real(input, 0.2 * m, 2 * m, &wild);
  drive->generator.contact_half_angle_rad = take_real(input, 0.05, 0.61, &wild);
  drive->generator.cam_offset_mm = choice & 16 ? take_real(input, 0, 6 * m, &wild) : (lm_real)0;
  drive->generator.floating = 1;
  if (choice & 32) {
    drive->flexspline.rim_thickness_mm = take_real(input, 0.002 * m * drive->teeth.flexspline_teeth,
                                                   0.1 * m * drive->teeth.flexspline_teeth, &wild);
    drive->flexspline.wall_thickness_mm = take_real(input, 0.05, 5, &wild);
    drive->flexspline.length_mm = take_real(input, 1, 500, &wild);
    drive->axial_sections = take_byte(input) % 8;
  }
  if (choice & 128) { /* any bytes anywhere */
    const size_t place = (size_t)take_byte(input) * 8 % sizeof(*drive);
    take(input, (char *)drive + place, 8 < sizeof(*drive) - place ? 8 : sizeof(*drive) - place);
  }
}

static void check_gap(const lm_gap *gap) {
  if (isinf(gap->gap_rad)) {
    demand(gap->gap_rad > 0 && gap->radius_mm == 0 && gap->flank_angle_rad == 0);
  } else {
    demand(isfinite(gap->gap_rad) && gap->radius_mm > 0 && isfinite(gap->flank_angle_rad));
  }
}

/* A list of clearances, and the same angles one by one after half a turn. */
static int check_lobe(const lm_mesh *mesh, lm_real phase, lm_clearance lobe[]) {
  const lm_real quarter = LM_PI / 2;
  lm_fault fault;
  int count = -1;
  int i;
  const lm_status status = lm_lobe_clearances(mesh, phase, lobe, LM_LOBE_TEETH_MAX, &count, &fault);
  if (status != LM_OK) {
    demand(status == LM_NOT_FINITE && !isfinite(phase) && count == -1);
    return 0;
  }
  demand(count >= mesh->geometry.flexspline_teeth / 2);
  demand(count <= mesh->geometry.flexspline_teeth / 2 + 1);
  for (i = 0; i < count; i++) {
    demand(lobe[i].angle_rad >= -quarter && lobe[i].angle_rad <= quarter);
    demand(i == 0 || lobe[i].angle_rad > lobe[i - 1].angle_rad);
    check_gap(&lobe[i].forward);
    check_gap(&lobe[i].backward);
    if (i % 16 == 0) {
      const lm_clearance mirrored = lm_tooth_clearance(mesh, -lobe[i].angle_rad);
      demand(memcmp(&mirrored.backward, &lobe[i].forward, sizeof(lm_gap)) == 0);
      demand(memcmp(&mirrored.forward, &lobe[i].backward, sizeof(lm_gap)) == 0);
    }
  }
  return count;
}

/* --- take-up --- */

static void check_states(const lm_take_up states[], const lm_real torque[], int torques,
                         const lm_rest *rest, int count) {
  int i;
  demand(isfinite(rest->middle_rad) && rest->free_play_rad >= 0);
  demand(rest->preloaded >= 0 && rest->preloaded <= count);
  demand(rest->preloaded == 0 || rest->free_play_rad == 0);
  for (i = 0; i < torques; i++) {
    const lm_take_up *s = &states[i];
    const lm_real size = s->angle_rad < 0 ? -s->angle_rad : s->angle_rad;
    const lm_real sum = s->clearance_rad + s->tooth_rad + s->ring_rad + s->twist_rad;
    demand(isfinite(s->angle_rad) && isfinite(sum) && s->stiffness_Nm_per_rad >= 0);
    demand((sum < s->angle_rad ? s->angle_rad - sum : sum - s->angle_rad) <= ROUNDING * size);
    demand(torque[i] > 0 ? s->angle_rad >= 0 : torque[i] < 0 ? s->angle_rad <= 0 : size == 0);
    demand(s->forward_teeth >= 0 && s->forward_teeth + s->backward_teeth <= count);
    demand(i == 0 || s->angle_rad >= states[i - 1].angle_rad - ROUNDING * size);
  }
}

/* Requirements of lm_coupled_take_up for its torques. */
static int rising(const lm_real torque[], int torques) {
  int i;
  for (i = 0; i < torques; i++) {
    const int in_range = torque[i] >= (lm_real)-1e9 && torque[i] <= (lm_real)1e9;
    if (!in_range || (i > 0 && !(torque[i] > torque[i - 1]))) {
      return 0;
    }
  }
  return 1;
}

static lm_contact contacts[2 * LM_LOBE_TEETH_MAX];
static lm_foundation foundation;
static lm_take_up_workspace workspace;

static void check_take_up(int count, const lm_real torque[], int torques, int tame) {
  lm_take_up states[FUZZED_TORQUES];
  lm_rest rest;
  lm_fault fault;
  lm_status status;
  memset(&rest, UNTOUCHED, sizeof(rest));
  status = lm_coupled_take_up(contacts, count, &foundation, torque, torques, states, &rest,
                              &workspace, &fault);
  if (status != LM_OK) {
    demand(status == fault.status && fault.input != 0);
    demand(untouched(&rest, sizeof(rest)));
    demand(!tame || status == LM_NO_CONTACT || !rising(torque, torques));
    return;
  }
  demand(rising(torque, torques));
  demand(workspace.stage_count <= LM_STAGES_MAX);
  if (tame) {
    check_states(states, torque, torques, &rest, count);
  }
}

static int take_torques(fuzz_input *input, lm_real torque[]) {
  const int torques = 1 + take_byte(input) % FUZZED_TORQUES;
  lm_real last = -200;
  int wild = 0;
  int i;
  for (i = 0; i < torques; i++) {
    const lm_real step = take_real(input, 0, 60, &wild);
    torque[i] = wild ? step : last + step;
    last = torque[i];
    wild = 0;
  }
  return torques;
}

/* The pairs of a lobe on the foundation of section 3.2, scaled to the drive. */
static void take_up_lobe(fuzz_input *input, const lm_drive *drive, const lm_mesh *mesh,
                         const lm_clearance lobe[], int teeth) {
  lm_real torque[FUZZED_TORQUES];
  const int torques = take_torques(input, torque);
  const lm_real pitch =
      2 * LM_PI * mesh->geometry.neutral_mm / (lm_real)mesh->geometry.flexspline_teeth;
  lm_fault fault;
  int count = 0;
  int i;
  memset(&foundation, 0, sizeof(foundation));
  foundation.sections = 1;
  foundation.lobes = 1;
  demand(lm_beam_yield(2600, drive->support.ring_stiffness_N_mm2, pitch, drive->support.ring_factor,
                       teeth, foundation.yield_mm_per_N, &fault) == LM_OK);
  for (i = 0; i < 2 * teeth; i++) {
    const lm_gap *gap = i % 2 == 0 ? &lobe[i / 2].forward : &lobe[i / 2].backward;
    if (gap->gap_rad < (lm_real)0.003 && gap->gap_rad > (lm_real)-0.003 &&
        gap->flank_angle_rad > 0 && gap->flank_angle_rad < 1) {
      lm_contact *c = &contacts[count++];
      c->arm_mm = gap->radius_mm;
      c->wedge = gap->flank_angle_rad;
      c->gap_rad = gap->gap_rad;
      c->compliance_mm_per_N = (lm_real)4e-6;
      c->tooth = i / 2;
      c->lobe = 0;
      c->section = 0;
      c->side = i % 2 == 0 ? 1 : -1;
    }
  }
  /* Numbers derived from the drive are far from the last digit; others may not be. */
  if (count > 0) {
    check_take_up(count, torque, torques,
                  drive->support.foundation_N_per_mm2 == 0 &&
                      drive->support.ring_factor == (lm_real)1 &&
                      drive->support.ring_stiffness_N_mm2 < (lm_real)1e9);
  }
}

static void fuzz_drive(fuzz_input *input) {
  static lm_clearance lobe[LM_LOBE_TEETH_MAX];
  static lm_mesh mesh;
  lm_drive drive;
  lm_drive before;
  lm_fault fault;
  lm_status status;
  int wild = 0;
  int section;
  take_drive(input, &drive);
  before = drive;
  status = lm_complete_drive(&drive, &fault);
  if (status != LM_OK) {
    demand(status == fault.status && fault.input != 0);
    demand(memcmp(&before, &drive, sizeof(drive)) == 0);
  }
  before = drive;
  status = lm_check_drive(&drive, &fault);
  demand(memcmp(&before, &drive, sizeof(drive)) == 0);
  memset(&mesh, UNTOUCHED, sizeof(mesh));
  if (status != LM_OK) {
    demand(status == fault.status && fault.input != 0);
    if (lm_make_mesh(&drive, 1, 8, &mesh, &fault) != LM_OK) {
      demand(untouched(&mesh, sizeof(mesh)));
    }
    return;
  }
  for (section = 0; section < drive.axial_sections; section += 3) {
    const lm_real factor = lm_section_factor(&drive, section, drive.axial_sections);
    int teeth;
    demand(lm_make_mesh(&drive, factor, 16, &mesh, &fault) == LM_OK);
    teeth = check_lobe(&mesh, take_real(input, -1, 1, &wild), lobe);
    if (teeth > 0) {
      take_up_lobe(input, &drive, &mesh, lobe, teeth);
    }
  }
}

/* --- random pairs --- */

static void fuzz_contacts(fuzz_input *input) {
  const int count = take_byte(input) % (FUZZED_CONTACTS + 1);
  lm_real torque[FUZZED_TORQUES];
  lm_real own = 0;
  lm_fault fault;
  int wild = 0;
  int torques;
  int i;
  int s;
  int t;
  memset(&foundation, 0, sizeof(foundation));
  foundation.sections = take_byte(input) % 4;
  foundation.lobes = take_byte(input) % 4;
  if (lm_beam_yield(take_real(input, 100, 1e4, &wild), take_real(input, 1e5, 1e6, &wild),
                    take_real(input, 0.2, 2, &wild), take_real(input, 0, 10, &wild),
                    LM_LOBE_TEETH_MAX, foundation.yield_mm_per_N, &fault) != LM_OK) {
    demand(wild);
  }
  /* Each section twists as far as those between it and the cup, plus its own share. */
  for (s = 0; s < foundation.sections; s++) {
    own += take_real(input, 0, 1e-8, &wild);
    for (t = s; t < foundation.sections; t++) {
      foundation.twist_rad_per_Nmm[s][t] = own;
      foundation.twist_rad_per_Nmm[t][s] = own;
    }
  }
  wild = wild || foundation.sections == 0 || foundation.lobes == 0 || foundation.lobes == 3;
  for (i = 0; i < count; i++) {
    const uint8_t place = take_byte(input);
    lm_contact *c = &contacts[i];
    c->arm_mm = take_real(input, 10, 50, &wild);
    c->wedge = take_real(input, 0, 1, &wild);
    c->gap_rad = take_real(input, -0.001, 0.002, &wild);
    c->compliance_mm_per_N = take_real(input, 1e-6, 1e-3, &wild);
    c->tooth = take_byte(input);
    c->lobe = foundation.lobes == 2 ? place & 1 : 0;
    c->section = foundation.sections > 0 ? place / 2 % foundation.sections : 0;
    c->side = place & 128 ? 1 : -1;
    if (place == 77) {
      take(input, &c->tooth, sizeof(c->tooth));
      take(input, &c->side, sizeof(c->side));
      wild = 1;
    }
  }
  torques = take_torques(input, torque);
  check_take_up(count, torque, torques, count > 0 && !wild);
}

/* --- springs --- */

static void fuzz_springs(fuzz_input *input) {
  lm_spring springs[FUZZED_CONTACTS];
  const int count = take_byte(input) % (FUZZED_CONTACTS + 1);
  lm_real angle[2] = {7, 7};
  lm_real torque[2];
  int engaged = 7;
  int wild = 0;
  int i;
  lm_fault fault;
  lm_status status[2];
  for (i = 0; i < count; i++) {
    springs[i].stiffness_Nm_per_rad = take_real(input, 10, 1e5, &wild);
    springs[i].gap_rad = take_real(input, -1e-3, 2e-3, &wild);
    springs[i].side = take_byte(input) % 2 == 0 ? 1 : -1;
  }
  torque[0] = take_real(input, -100, 100, &wild);
  torque[1] = torque[0] + take_real(input, 0.01, 100, &wild);
  for (i = 0; i < 2; i++) {
    status[i] = lm_independent_take_up(springs, count, torque[i], &angle[i], &engaged, &fault);
    demand(status[i] == LM_OK ? engaged >= 0 && engaged <= count : angle[i] == 7);
  }
  if (!wild && status[0] == LM_OK && status[1] == LM_OK) {
    demand(isfinite(angle[0]) && angle[1] > angle[0]);
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  fuzz_input input;
  uint8_t what;
  input.data = data;
  input.size = size;
  what = take_byte(&input) % 4;
  if (what < 2) {
    fuzz_drive(&input);
  } else if (what == 2) {
    fuzz_contacts(&input);
  } else {
    fuzz_springs(&input);
  }
  return 0;
}
