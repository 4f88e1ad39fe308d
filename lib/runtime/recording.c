/* Whole recordings: bit-identical to lm_step_model sample by sample, but faster. Work common to all
 * samples is done once (columns that were not measured, bands that nothing widens), and each effect
 * runs over a block of samples before the next one does. */
#include "lostmotion/model.h"

#include <stddef.h>

#include "runtime/model_kernel.h"
#include "runtime/number.h"

/* Input of the model at a sample. */
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
    angle_rad[k] = step_model(parameters, memory, 0, input_rad, 0, 0, 0);
  }
}

#else

/* Half of the operators in the arrays are sufficient if no more are used. */
#define FEW_PLAYS ((LM_PLAYS_MAX + 1) / 2)

/* A settled memory is within the bands, so both edges may be applied for any torque direction. */
static inline lm_real push_constant(const lm_play_slot *slot, lm_real *place_Nm, lm_real at_Nm) {
  lm_real z_Nm = greatest(*place_Nm, at_Nm - slot->radius_Nm);
  z_Nm = least(z_Nm, at_Nm + slot->radius_Nm);
  *place_Nm = z_Nm;
  return z_Nm;
}

/* One step of operators whose bands have the same width at every torque. The bits are those of
 * advance_plays, and of lm_advance_scaled_plays with a width_scale of 1. Unused slots have no
 * weight. */
static inline lm_play_sum advance_constant(const lm_play_bank *bank, int32_t slots,
                                           lm_play_memory *memory, lm_real torque_Nm) {
  lm_real at_Nm = envelope_at(bank, torque_Nm);
  running_sum sum;
  int32_t i;
  start_sum(&sum, bank, push_constant(&bank->slot[0], &memory->z_Nm[0], at_Nm));
  UNROLL
  for (i = 1; i < slots; ++i) {
    add_to_sum(&sum, bank, i, push_constant(&bank->slot[i], &memory->z_Nm[i], at_Nm));
  }
  memory->torque_Nm = torque_Nm;
  return split_sum(&sum, bank, at_Nm);
}

/* Slots to be computed if every band has constant width, 0 if one has not. */
static int32_t constant_slots(const lm_play_bank *bank) {
  if (bank->widens) {
    return 0;
  }
  return bank->count <= FEW_PLAYS ? FEW_PLAYS : LM_PLAYS_MAX;
}

/* Torsion curve and operators. `slots` is a constant wherever this is inlined, so that the loop
 * over the operators is written out; 0: by the kernel of the controller. */
static inline lm_real wind_up(const lm_parameters *parameters, lm_memory *memory, int32_t slots,
                              lm_real torque_Nm, lm_real followed_Nm, lm_real compliance,
                              lm_real *wound_Nm) {
  lm_play_sum sum = slots > 0
                        ? advance_constant(&parameters->plays, slots, &memory->plays, followed_Nm)
                        : advance_plays(&parameters->plays, &memory->plays, followed_Nm);
  *wound_Nm = torque_Nm + sum.inside_Nm;
  return compliance * evaluate_curve(&parameters->curve, *wound_Nm) + sum.outside_rad;
}

static inline void run_plain(const lm_parameters *parameters, lm_memory *memory, int32_t slots,
                             const lm_recording *recording, lm_real *angle_rad) {
  lm_real wound_Nm;
  int64_t k;
  for (k = 0; k < recording->count; ++k) {
    lm_real torque_Nm = input_of(parameters, recording->torque_Nm, k, memory->plays.torque_Nm);
    angle_rad[k] = wind_up(parameters, memory, slots, torque_Nm, torque_Nm, 1, &wound_Nm);
  }
}

#if LM_EFFECTS_MAX > 0

/* Samples of a block; their conditions take 1.5 kB of stack in float. */
#define BLOCK 32

/* Memory of an effect. */
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
  lm_real compliance[BLOCK];
  lm_real followed_Nm[BLOCK];
  lm_real width_scale[BLOCK];
  int32_t rows;
} block;

static void start_block(block *b) {
  static const lm_conditions nothing = NOTHING_KNOWN;
  int32_t k;
  for (k = 0; k < BLOCK; ++k) {
    b->at[k] = nothing;
  }
}

/* A needed and measured column, or null; unmeasured conditions stay zero. */
static const lm_real *needed(uint32_t needs, uint32_t need, const lm_real *column, int64_t from) {
  return (needs & need) && column ? &column[from] : NULL;
}

#define NO_COLUMN(field, ...)
#define COLUMN_BOUNDED(field, NEED, most) \
  const lm_real *field = needed(needs, LM_NEEDS_##NEED, recording->field, from);
#define COLUMN_FITTED(field, NEED, usual, uses) \
  const lm_real *field = needed(needs, LM_NEEDS_##NEED | (uses), recording->field, from);
#define FROM_BOUNDED(field, NEED, most)            \
  if (field) {                                     \
    at->field = judge(field[k], most, 0, &status); \
  }
#define FROM_FITTED(field, NEED, usual, uses)                        \
  if (field) {                                                       \
    at->field = judge_range(field[k], valid->field, usual, &status); \
  }

/* Columns as step_model reads their conditions. */
static void read_columns(block *b, const lm_parameters *parameters, uint32_t needs,
                         const lm_recording *recording, int64_t from) {
  LM_CONDITION_LIST(NO_COLUMN, COLUMN_BOUNDED, COLUMN_FITTED, COLUMN_FITTED)
  const lm_real *elapsed_s = recording->elapsed_s ? &recording->elapsed_s[from] : NULL;
  const lm_validity *valid = &parameters->valid;
  uint32_t status = 0;
  int32_t k;
  for (k = 0; k < b->rows; ++k) {
    lm_conditions *at = &b->at[k];
    LM_CONDITION_LIST(NO_COLUMN, FROM_BOUNDED, FROM_FITTED, FROM_FITTED)
    if (elapsed_s) {
      at->elapsed_s = take_elapsed(elapsed_s[k], 0);
    }
  }
}

/* Torque, compliance and what the operators follow, by the effects before `torques` and from there
 * to before `end`, sample by sample; an invalid torque is replaced by the previous. */
static void find_torques(const lm_parameters *parameters, int32_t torques, int32_t end,
                         lm_memory *memory, block *b, const lm_real *column, int64_t from) {
  lm_real limit_Nm = parameters->torque_limit_Nm;
  lm_real before_Nm = memory->plays.torque_Nm;
  int32_t k;
  for (k = 0; k < b->rows; ++k) {
    lm_conditions *at = &b->at[k];
    lm_real measured_Nm = input_of(parameters, column, from + k, before_Nm);
    lm_real torque_Nm = measured_Nm;
    lm_real compliance = 1;
    int told = !column || is_told(column[from + k]);
    int32_t own = 0;
    int32_t e;
    at->torque_Nm = measured_Nm;
    at->wound_Nm = measured_Nm;
    at->elastic_rad = 0;
    for (e = 0; e < torques; ++e) {
      const lm_effect_use *use = &parameters->effect[e];
      torque_Nm += use->effect->run(use->value, own_memory(memory, own), at);
      own += use->effect->memory_count;
    }
    torque_Nm = told ? believe(torque_Nm, measured_Nm, limit_Nm) : measured_Nm;
    at->torque_Nm = torque_Nm;
    at->wound_Nm = torque_Nm;
    before_Nm = torque_Nm;
    if (torques < end) {
      for (e = torques; e < end; ++e) {
        const lm_effect_use *use = &parameters->effect[e];
        compliance += use->effect->run(use->value, own_memory(memory, own), at);
        own += use->effect->memory_count;
      }
      compliance = limit_compliance(compliance);
      before_Nm = follow(parameters, &memory->plays, &torque_Nm, compliance, told);
      at->torque_Nm = torque_Nm;
      at->wound_Nm = torque_Nm;
    }
    b->compliance[k] = compliance;
    b->followed_Nm[k] = before_Nm;
  }
}

#define WIDENED (-1)

/* Torsion curve and operators of a block. `slots` as in wind_up, WIDENED where effects widen the
 * bands. */
static inline void wind_up_block(const lm_parameters *parameters, lm_memory *memory, int32_t slots,
                                 block *b, lm_real *angle_rad) {
  int32_t k;
  for (k = 0; k < b->rows; ++k) {
    lm_conditions *at = &b->at[k];
    if (slots != WIDENED) {
      angle_rad[k] = wind_up(parameters, memory, slots, at->torque_Nm, b->followed_Nm[k],
                             b->compliance[k], &at->wound_Nm);
    } else {
      lm_real scale = clamp(b->width_scale[k], 0, LM_WIDTH_SCALE_MAX);
      lm_play_sum sum =
          lm_advance_scaled_plays(&parameters->plays, &memory->plays, b->followed_Nm[k], scale);
      at->wound_Nm = at->torque_Nm + sum.inside_Nm;
      angle_rad[k] =
          b->compliance[k] * evaluate_curve(&parameters->curve, at->wound_Nm) + sum.outside_rad;
      memory->width_scale = greatest(memory->width_scale, scale);
    }
    at->elastic_rad = angle_rad[k];
  }
}

/* Memory of the effects before a given one. */
static int32_t memory_before(const lm_parameters *parameters, int32_t end) {
  int32_t sum = 0;
  int32_t e;
  for (e = 0; e < end; ++e) {
    sum += parameters->effect[e].effect->memory_count;
  }
  return sum;
}

/* Number of effects of a kind or an earlier one, which come first. */
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
    lm_conditions *at = &b->at[k];
    at->elastic_rad = b->compliance[k] * evaluate_curve(&parameters->curve, at->torque_Nm);
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
  int32_t torques = effects_up_to(parameters, LM_EFFECT_TORQUE);
  int32_t widths = effects_up_to(parameters, LM_EFFECT_COMPLIANCE);
  int32_t angles = effects_up_to(parameters, LM_EFFECT_WIDTH);
  int32_t bands = angles > widths ? WIDENED : slots;
  /* What operators follow under effects on the compliance depends on the sample before. */
  int64_t rows = widths > torques ? 1 : BLOCK;
  uint32_t needs = needs_of(parameters);
  int64_t from;
  block b;
  start_block(&b);
  for (from = 0; from < recording->count; from += b.rows) {
    int64_t left = recording->count - from;
    lm_real *angle = &angle_rad[from];
    b.rows = (int32_t)(left < rows ? left : rows);
    read_columns(&b, parameters, needs, recording, from);
    find_torques(parameters, torques, widths, memory, &b, recording->torque_Nm, from);
    if (bands == WIDENED) {
      scale_widths(parameters, widths, angles, memory, &b);
      wind_up_block(parameters, memory, WIDENED, &b, angle);
    } else if (bands == 0) {
      wind_up_block(parameters, memory, 0, &b, angle);
    } else if (bands == FEW_PLAYS) {
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
  /* Skipped slots have no width. */
  for (i = slots > 0 ? slots : LM_PLAYS_MAX; i < LM_PLAYS_MAX; ++i) {
    memory->plays.z_Nm[i] = envelope_at(&parameters->plays, memory->plays.torque_Nm);
  }
}

#endif
