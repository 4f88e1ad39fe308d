/* The keys of a drive's [design] as data: for readers of drive files, reference pages, messages.
 *
 * Name, unit, kind, range, default and meaning of each key, from the list in design_key_list.h; and
 * the names of the values of the enumerations of a drive.
 */
#ifndef LOSTMOTION_DESIGN_KEYS_H
#define LOSTMOTION_DESIGN_KEYS_H

#include "lostmotion/design_key_list.h"
#include "lostmotion/drive.h"
#include "lostmotion/status.h"
#include "lostmotion/tolerance.h"

LM_BEGIN_DECLS

/* Type of a value. */
typedef enum lm_key_kind {
  LM_KIND_REAL = 0,
  LM_KIND_COUNT = 1,       /* a whole number */
  LM_KIND_SWITCH = 2,      /* 0 or 1; false or true in a file */
  LM_KIND_DEFORMATION = 3, /* lm_deformation; by name in a file */
  LM_KIND_GENERATOR = 4,   /* lm_generator_type; by name in a file */
  LM_KIND_FLANK = 5        /* lm_flank_kind; by name in a file */
} lm_key_kind;

/* Unit of a range. */
typedef enum lm_key_measure {
  LM_PER_ONE = 0,      /* the unit of the key */
  LM_PER_DEGREE = 1,   /* degrees, of a key in rad */
  LM_PER_ARCMIN = 2,   /* arc minutes, of a key in rad */
  LM_PER_MODULE = 3,   /* modules */
  LM_PER_DIAMETER = 4, /* pitch diameters of the flexspline, module times teeth */
  LM_PER_RIM = 5,      /* rim thicknesses */
  LM_PER_FACE = 6      /* face widths */
} lm_key_measure;

/* Treatment of a key in a drive file. */
typedef enum lm_key_file {
  LM_FILE_REQUIRED = 0,
  LM_FILE_DEFAULT = 1, /* if left out, it is `usual` */
  LM_FILE_FILLED = 2   /* if left out, it is 0, which lm_complete_drive may replace */
} lm_key_file;

/* One key. The texts are constant and never freed. */
typedef struct lm_design_key {
  const char *section; /* member of lm_drive and table of the file; "drive": [design] itself */
  const char *stem;    /* the key without its unit */
  const char *suffix;  /* "_mm", ...; "" for a pure number */
  const char *meaning; /* one sentence without a full stop */
  lm_key_kind kind;
  lm_key_measure per;
  lm_key_file file;
  lm_real low;   /* of the range, in `per` */
  lm_real high;  /* of the range, in `per` */
  lm_real usual; /* in the key's unit; 0 where there is none */
} lm_design_key;

#define LM_COUNT_KEY(id, ...) +1
enum {
  LM_DESIGN_KEY_COUNT = 0 LM_DESIGN_KEYS(LM_COUNT_KEY, LM_COUNT_KEY) /* keys in the list */
};
#undef LM_COUNT_KEY

/* The key of an index, 0 .. LM_DESIGN_KEY_COUNT - 1, by section. LM_NULL, LM_OUT_OF_RANGE. */
lm_status lm_describe_design_key(int index, lm_design_key *key, lm_fault *fault);

/* Names as in drive files; "" outside the enumeration. */
const char *lm_deformation_name(int deformation);
const char *lm_generator_name(int type);
const char *lm_flank_name(int kind);
const char *lm_distribution_name(int distribution);
const char *lm_zone_name(int zone);

LM_END_DECLS

#endif
