#include "lostmotion/effects.h"

#include "runtime/number.h"

const lm_effect *lm_find_effect(const lm_effect *const *table, int32_t count, uint32_t id) {
  int32_t i;
  for (i = 0; i < count; ++i) {
    if (table[i]->id == id) {
      return table[i];
    }
  }
  return 0;
}

/* A user effect is not trusted before this check. */
static lm_status check_form(const lm_effect *effect, lm_fault *fault) {
  lm_status status;
  if (!effect->run) {
    return lm_refuse(fault, LM_NULL, "run", 0, 0, 0);
  }
  status = lm_check_range(fault, "kind", LM_REAL((int32_t)effect->kind), LM_REAL(LM_EFFECT_TORQUE),
                          LM_REAL(LM_EFFECT_ANGLE));
  if (status == LM_OK) {
    status = lm_check_range(fault, "value_count", LM_REAL(effect->value_count), 1,
                            LM_REAL(LM_EFFECT_VALUES_MAX));
  }
  if (status == LM_OK && effect->memory_count < 0) {
    status = lm_refuse(fault, LM_OUT_OF_RANGE, "memory_count", LM_REAL(effect->memory_count), 0,
                       LM_REAL(LM_EFFECT_MEMORY_MAX));
  }
  return status;
}

/* Stored values are binary32: one at its bound may be beyond it by a rounding if lm_real is
 * wider. */
static lm_real rounded_down(lm_real bound) {
  return least(bound, LM_REAL((float)bound));
}

static lm_real rounded_up(lm_real bound) {
  return greatest(bound, LM_REAL((float)bound));
}

lm_status lm_check_effect(const lm_effect *effect, const lm_real *value, lm_fault *fault) {
  lm_status status;
  int32_t i;
  if (!effect || !value) {
    return lm_refuse(fault, LM_NULL, "effect", 0, 0, 0);
  }
  status = check_form(effect, fault);
  if (status != LM_OK) {
    return status;
  }
  for (i = 0; i < effect->value_count; ++i) {
    const char *name = effect->card ? effect->card->value[i].name : "value";
    status = lm_check_range(fault, name, value[i], rounded_down(effect->bound[i][0]),
                            rounded_up(effect->bound[i][1]));
    if (status != LM_OK) {
      return status;
    }
  }
  return LM_OK;
}

static lm_real read(const lm_real *column, int64_t k, lm_real missing) {
  return column ? column[k] : missing;
}

#define READ_OR_ZERO(field, ...) at.field = read(recording->field, k, 0);
#define READ_OR_USUAL(field, NEED, usual, uses) at.field = read(recording->field, k, usual);

lm_conditions lm_read_conditions(const lm_recording *recording, int64_t k) {
  lm_conditions at;
  LM_CONDITION_LIST(READ_OR_ZERO, READ_OR_ZERO, READ_OR_USUAL, READ_OR_USUAL)
  at.elastic_rad = read(recording->elastic_rad, k, 0);
  at.wound_Nm = read(recording->wound_Nm, k, at.torque_Nm);
  return at;
}

void lm_run_effect(const lm_effect *effect, const lm_real *value, lm_real *memory,
                   const lm_recording *recording, lm_real *result) {
  int64_t k;
  for (k = 0; k < recording->count; ++k) {
    lm_conditions at = lm_read_conditions(recording, k);
    result[k] = effect->run(value, memory, &at);
  }
}
