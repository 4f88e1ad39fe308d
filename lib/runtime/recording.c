/* Whole recordings: the bits of lm_step_model sample by sample, in less time. What is the same for
 * every sample is done once (columns that were not measured, bands that nothing widens), and each
 * effect runs over a block of samples before the next one does. */
#include "lostmotion/model.h"
#include "runtime/model_kernel.h"
#include "runtime/number.h"

/* What drives the model at a sample. */
static inline lm_real input_of(const lm_parameters *parameters, const lm_real *column, int64_t k,
                               lm_real before) {
  return believe(column ? column[k] : 0, before, parameters->torque_limit_Nm);
}

#if LM_PROFILE == LM_PROFILE_GAP

void lm_run_model(const lm_parameters *parameters, lm_memory *memory, const lm_recording *recording,
                  lm_real *angle_rad) {
  int64_t k;
  for (k = 0; k < recording->count; ++k) {
    lm_real input_rad =
        input_of(parameters, recording->output_angle_rad, k, memory->plays.torque_Nm);
    angle_rad[k] = step_plain(parameters, memory, input_rad);
  }
}

#else

/* Of the operators that the arrays hold, half are enough where no more are in use. */
#define FEW_PLAYS ((LM_PLAYS_MAX + 1) / 2)

/* One step of plays whose bands are as wide at every torque. A settled memory lies within the
 * bands, so both edges may push it, whatever the torque's direction; the bits are those of
 * advance_plays, and of lm_advance_scaled_plays with a width_scale of 1. Slots not in use weigh
 * nothing. */
static inline lm_play_sum advance_constant(const lm_play_bank *bank, int32_t slots,
                                           lm_play_memory *memory, lm_real torque_Nm) {
  lm_real at_Nm = envelope_at(bank, torque_Nm);
  running_sum sum;
  int32_t i;
  start_sum(&sum);
  UNROLL
  for (i = 0; i < slots; ++i) {
    lm_real low_Nm = at_Nm - bank->slot[i].radius_Nm;
    lm_real high_Nm = at_Nm + bank->slot[i].radius_Nm;
    lm_real z_Nm = greatest(memory->z_Nm[i], low_Nm);
    z_Nm = least(z_Nm, high_Nm);
    memory->z_Nm[i] = z_Nm;
    add_to_sum(&sum, bank, i, z_Nm);
  }
  memory->torque_Nm = torque_Nm;
  return split_sum(&sum, bank, at_Nm);
}

/* Slots to be computed where every band is as wide at every torque, 0 where one is not. */
static int32_t constant_slots(const lm_play_bank *bank) {
  int32_t i;
  for (i = 0; i < bank->count; ++i) {
    if (bank->slot[i].edge_slope[1] != 1) {
      return 0;
    }
  }
  return bank->count <= FEW_PLAYS ? FEW_PLAYS : LM_PLAYS_MAX;
}

/* Backbone and plays. `slots` is a constant wherever this is taken in, so that the loop over the
 * plays is written out; 0: by the kernel of the controller. */
static inline lm_real wind_up(const lm_parameters *parameters, lm_memory *memory, int32_t slots,
                              lm_real torque_Nm, lm_real *wound_Nm) {
  lm_play_sum sum = slots > 0
                        ? advance_constant(&parameters->plays, slots, &memory->plays, torque_Nm)
                        : advance_plays(&parameters->plays, &memory->plays, torque_Nm);
  *wound_Nm = torque_Nm + sum.inside_Nm;
  return evaluate_curve(&parameters->curve, *wound_Nm) + sum.outside_rad;
}

static inline void run_plain(const lm_parameters *parameters, lm_memory *memory, int32_t slots,
                             const lm_recording *recording, lm_real *angle_rad) {
  lm_real wound_Nm;
  int64_t k;
  for (k = 0; k < recording->count; ++k) {
    lm_real torque_Nm = input_of(parameters, recording->torque_Nm, k, memory->plays.torque_Nm);
    angle_rad[k] = wind_up(parameters, memory, slots, torque_Nm, &wound_Nm);
  }
}

#if LM_EFFECTS_MAX > 0

/* Samples of a block: their conditions take 1.5 kB of stack in float. */
#define BLOCK 32

/* Where an effect keeps its memory. */
static lm_real *own_memory(lm_memory *memory, int32_t at) {
#if LM_EFFECT_MEMORY_MAX > 0
  return &memory->effect[at];
#else
  (void)memory;
  (void)at;
  return 0;
#endif
}

/* A block of samples on their way through the effects. */
typedef struct block {
  lm_conditions at[BLOCK];
  lm_real width_scale[BLOCK];
  int32_t rows;
} block;

/* Nothing known: columns that were not measured stay so. */
static void start_block(block *b) {
  static const lm_conditions unknown = LM_CONDITIONS_UNKNOWN;
  int32_t k;
  for (k = 0; k < BLOCK; ++k) {
    b->at[k] = unknown;
  }
}

static void read_columns(block *b, const lm_recording *recording, int64_t from) {
  int32_t k;
  for (k = 0; k < b->rows; ++k) {
    lm_conditions *at = &b->at[k];
    int64_t row = from + k;
    if (recording->input_angle_rad) {
      at->input_angle_rad = known_angle(recording->input_angle_rad[row]);
    }
    if (recording->output_angle_rad) {
      at->output_angle_rad = known_angle(recording->output_angle_rad[row]);
    }
    if (recording->input_velocity_rad_s) {
      at->input_velocity_rad_s = known(recording->input_velocity_rad_s[row], 0);
    }
    if (recording->output_acceleration_rad_s2) {
      at->output_acceleration_rad_s2 = known(recording->output_acceleration_rad_s2[row], 0);
    }
    if (recording->temperature_C) {
      at->temperature_C = known(recording->temperature_C[row], LM_REFERENCE_TEMPERATURE_C);
    }
    if (recording->cycles) {
      at->cycles = known(recording->cycles[row], 0);
    }
    if (recording->tilt_moment_Nm) {
      at->tilt_moment_Nm = known(recording->tilt_moment_Nm[row], 0);
    }
    if (recording->axial_force_N) {
      at->axial_force_N = known(recording->axial_force_N[row], 0);
    }
    if (recording->elapsed_s) {
      at->elapsed_s = clamp(recording->elapsed_s[row], 0, ELAPSED_MAX);
    }
  }
}

/* The torque that the plays get, sample by sample: one without meaning is the one before. */
static void find_torques(const lm_parameters *parameters, int32_t count, lm_memory *memory,
                         block *b, const lm_real *column, int64_t from) {
  lm_real before_Nm = memory->plays.torque_Nm;
  int32_t k;
  for (k = 0; k < b->rows; ++k) {
    lm_conditions *at = &b->at[k];
    lm_real measured_Nm = input_of(parameters, column, from + k, before_Nm);
    lm_real torque_Nm = measured_Nm;
    int32_t own = 0;
    int32_t e;
    at->torque_Nm = measured_Nm;
    at->wound_Nm = measured_Nm;
    at->elastic_rad = 0;
    for (e = 0; e < count; ++e) {
      const lm_effect_use *use = &parameters->effect[e];
      torque_Nm += use->effect->run(use->value, own_memory(memory, own), at);
      own += use->effect->memory_count;
    }
    before_Nm = column && !is_finite(column[from + k])
                    ? measured_Nm
                    : believe(torque_Nm, measured_Nm, parameters->torque_limit_Nm);
    at->torque_Nm = before_Nm;
    at->wound_Nm = before_Nm;
  }
}

/* Backbone and plays of a block. `slots` as in wind_up, 0 where effects may widen the bands. */
static inline void wind_up_block(const lm_parameters *parameters, lm_memory *memory, int32_t slots,
                                 block *b, lm_real *angle_rad) {
  int32_t k;
  for (k = 0; k < b->rows; ++k) {
    lm_conditions *at = &b->at[k];
    lm_real scale = slots > 0 ? 1 : clamp(b->width_scale[k], 0, LM_WIDTH_SCALE_MAX);
    if (slots > 0) {
      angle_rad[k] = wind_up(parameters, memory, slots, at->torque_Nm, &at->wound_Nm);
    } else {
      lm_play_sum sum =
          lm_advance_scaled_plays(&parameters->plays, &memory->plays, at->torque_Nm, scale);
      at->wound_Nm = at->torque_Nm + sum.inside_Nm;
      angle_rad[k] = evaluate_curve(&parameters->curve, at->wound_Nm) + sum.outside_rad;
    }
    memory->width_scale = greatest(memory->width_scale, scale);
    at->elastic_rad = angle_rad[k];
  }
}

/* Numbers that the effects before one keep in memory. */
static int32_t memory_before(const lm_parameters *parameters, int32_t end) {
  int32_t sum = 0;
  int32_t e;
  for (e = 0; e < end; ++e) {
    sum += parameters->effect[e].effect->memory_count;
  }
  return sum;
}

/* How many effects are of a kind or of one before it: they come first. */
static int32_t effects_up_to(const lm_parameters *parameters, lm_effect_kind kind) {
  int32_t count = 0;
  while (count < parameters->effect_count && parameters->effect[count].effect->kind <= kind) {
    ++count;
  }
  return count;
}

/* The effects from `first` to before `end`, each over the whole block. The memory of those before
 * them comes first. */
static void scale_widths(const lm_parameters *parameters, int32_t first, int32_t end,
                         lm_memory *memory, block *b) {
  int32_t own = memory_before(parameters, first);
  int32_t e;
  int32_t k;
  for (k = 0; k < b->rows; ++k) {
    b->width_scale[k] = 1;
  }
  for (e = first; e < end; ++e) {
    const lm_effect_use *use = &parameters->effect[e];
    lm_real *mine = own_memory(memory, own);
    for (k = 0; k < b->rows; ++k) {
      b->width_scale[k] *= use->effect->run(use->value, mine, &b->at[k]);
    }
    own += use->effect->memory_count;
  }
}

static void add_angles(const lm_parameters *parameters, int32_t first, lm_memory *memory,
                       const block *b, lm_real *angle_rad) {
  int32_t own = memory_before(parameters, first);
  int32_t e;
  int32_t k;
  for (e = first; e < parameters->effect_count; ++e) {
    const lm_effect_use *use = &parameters->effect[e];
    lm_real *mine = own_memory(memory, own);
    for (k = 0; k < b->rows; ++k) {
      angle_rad[k] += use->effect->run(use->value, mine, &b->at[k]);
    }
    own += use->effect->memory_count;
  }
}

static void run_with_effects(const lm_parameters *parameters, lm_memory *memory, int32_t slots,
                             const lm_recording *recording, lm_real *angle_rad) {
  int32_t widths = effects_up_to(parameters, LM_EFFECT_TORQUE);
  int32_t angles = effects_up_to(parameters, LM_EFFECT_WIDTH);
  int32_t constant = angles > widths ? 0 : slots;
  int64_t from;
  block b;
  start_block(&b);
  for (from = 0; from < recording->count; from += b.rows) {
    int64_t left = recording->count - from;
    lm_real *angle = &angle_rad[from];
    b.rows = left < BLOCK ? (int32_t)left : BLOCK;
    read_columns(&b, recording, from);
    find_torques(parameters, widths, memory, &b, recording->torque_Nm, from);
    if (constant == 0) {
      scale_widths(parameters, widths, angles, memory, &b);
      wind_up_block(parameters, memory, 0, &b, angle);
    } else if (constant == FEW_PLAYS) {
      wind_up_block(parameters, memory, FEW_PLAYS, &b, angle);
    } else {
      wind_up_block(parameters, memory, LM_PLAYS_MAX, &b, angle);
    }
    add_angles(parameters, angles, memory, &b, angle);
  }
}

#endif

void lm_run_model(const lm_parameters *parameters, lm_memory *memory, const lm_recording *recording,
                  lm_real *angle_rad) {
  int32_t slots = constant_slots(&parameters->plays);
  int32_t i;
#if LM_EFFECTS_MAX > 0
  if (parameters->effect_count > 0) {
    run_with_effects(parameters, memory, slots, recording, angle_rad);
  } else
#endif
      if (slots == 0) {
    run_plain(parameters, memory, 0, recording, angle_rad);
  } else if (slots == FEW_PLAYS) {
    run_plain(parameters, memory, FEW_PLAYS, recording, angle_rad);
  } else {
    run_plain(parameters, memory, LM_PLAYS_MAX, recording, angle_rad);
  }
  /* Slots that were left out have no width. */
  for (i = slots > 0 ? slots : LM_PLAYS_MAX; i < LM_PLAYS_MAX; ++i) {
    memory->plays.z_Nm[i] = envelope_at(&parameters->plays, memory->plays.torque_Nm);
  }
}

#endif
