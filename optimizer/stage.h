/* The stages of a search, and the results for a combination. */
#ifndef LOSTMOTION_OPTIMIZER_STAGE_H
#define LOSTMOTION_OPTIMIZER_STAGE_H

#ifdef __cplusplus
extern "C" {
#endif

/* Result for a combination. */
typedef enum lm_fate {
  LM_FATE_NOT_REACHED = 0, /* the budget did not reach it, or the search was stopped */
  LM_FATE_PRUNED,          /* a limit excludes it before any search */
  LM_FATE_DOMINATED,       /* screened or raced, behind others */
  LM_FATE_SOLVED,          /* polished */
  LM_FATE_COUNT
} lm_fate;

typedef enum lm_search_stage {
  LM_STAGE_SCREEN = 0,
  LM_STAGE_EVOLVE,
  LM_STAGE_RACE,
  LM_STAGE_POLISH,
  LM_STAGE_TRADE_OFF, /* trade-off or restarts */
  LM_STAGE_REPAIR,    /* if no design satisfies all limits */
  LM_STAGE_VERIFY,
  LM_STAGE_DONE
} lm_search_stage;

typedef struct lm_search lm_search;

#ifdef __cplusplus
}
#endif

#endif
