#include "lostmotion/design_keys.h"

#include "refuse.h"

#define USUAL_SAME(value) (value)
#define USUAL_FOLLOWS(value) (value)
#define USUAL_IN_DEG(value) ((value) * (3.14159265358979323846 / 180.0))
#define USUAL_IN_ARCMIN(value) ((value) * (3.14159265358979323846 / 10800.0))

/* Code, not a table: a table of pointers would be data that is relocated at the start. */
#define DESCRIBE(id, section_, stem_, suffix_, kind_, per_, low_, high_, file_, usual_, vary_, \
                 meaning_)                                                                     \
  if (row++ == index) {                                                                        \
    key->section = #section_;                                                                  \
    key->stem = #stem_;                                                                        \
    key->suffix = #suffix_;                                                                    \
    key->meaning = meaning_;                                                                   \
    key->kind = LM_KIND_##kind_;                                                               \
    key->per = LM_PER_##per_;                                                                  \
    key->file = LM_FILE_##file_;                                                               \
    key->low = LM_REAL(low_);                                                                  \
    key->high = LM_REAL(high_);                                                                \
    key->usual = LM_REAL(USUAL_##vary_(usual_));                                               \
  }

lm_status lm_describe_design_key(int index, lm_design_key *key, lm_fault *fault) {
  int row = 0;
  if (key == 0) {
    return refuse(fault, LM_NULL, "key");
  }
  if (index < 0 || index >= LM_DESIGN_KEY_COUNT) {
    return refuse_range(fault, "index", LM_REAL(index), LM_REAL(0),
                        LM_REAL(LM_DESIGN_KEY_COUNT - 1));
  }
  LM_DESIGN_KEYS(DESCRIBE, DESCRIBE)
  return LM_OK;
}

const char *lm_deformation_name(int deformation) {
  switch (deformation) {
    case LM_INTERNAL:
      return "internal";
    case LM_EXTERNAL:
      return "external";
    default:
      return "";
  }
}

const char *lm_generator_name(int type) {
  switch (type) {
    case LM_COSINE:
      return "cosine";
    case LM_ELLIPSE:
      return "ellipse";
    case LM_DISCS:
      return "discs";
    case LM_ROLLERS:
      return "rollers";
    case LM_RING:
      return "ring";
    default:
      return "";
  }
}

const char *lm_flank_name(int kind) {
  switch (kind) {
    case LM_FLANK_INVOLUTE:
      return "involute";
    case LM_FLANK_DOUBLE_ARC:
      return "double_arc";
    case LM_FLANK_CONJUGATE:
      return "conjugate";
    case LM_FLANK_S_TOOTH:
      return "s_tooth";
    case LM_FLANK_POINTS:
      return "points";
    default:
      return "";
  }
}

const char *lm_distribution_name(int distribution) {
  switch (distribution) {
    case LM_NORMAL:
      return "normal";
    case LM_NORMAL_INSPECTED:
      return "normal_inspected";
    case LM_TRIANGULAR:
      return "triangular";
    case LM_UNIFORM:
      return "uniform";
    default:
      return "";
  }
}

const char *lm_zone_name(int zone) {
  switch (zone) {
    case LM_GENERATOR_GAP:
      return "generator";
    case LM_TEETH_GAP:
      return "teeth";
    default:
      return "";
  }
}
