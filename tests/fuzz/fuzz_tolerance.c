/* libFuzzer: for any links and plan, the tolerance functions either refuse and write nothing, or
 * give figures as documented in the header.
 *
 *   clang -g -O1 -fsanitize=fuzzer,address,undefined -ffp-contract=off -Ilib/include
 *     tests/fuzz/fuzz_tolerance.c lib/design/tolerance.c -lm -o fuzz_tolerance
 */
#include <math.h>
#include <string.h>

#include "fuzz_input.h"
#include "lostmotion/tolerance.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define FUZZED_LINKS 8
#define FUZZED_LOG2 6

/* Mostly realistic numbers, sometimes any bit pattern. */
static lm_real take_real(fuzz_input *input, lm_real unit) {
  int16_t whole;
  lm_real any;
  if (take_byte(input) < 16) {
    take(input, &any, sizeof(any));
    return any;
  }
  take(input, &whole, sizeof(whole));
  return unit * (lm_real)whole;
}

static void check_limits(lm_status status, const lm_tolerance_limits *limits) {
  int zone;
  if (status != LM_OK) {
    demand(untouched(limits, sizeof(*limits)));
    return;
  }
  for (zone = 0; zone < LM_GAP_ZONES; zone++) {
    demand(limits->signed_min_mm[zone] <= limits->signed_max_mm[zone]);
    demand(limits->gap_min_mm[zone] >= 0);
    demand(limits->gap_min_mm[zone] <= limits->gap_max_mm[zone]);
  }
  demand(limits->total_min_mm >= 0);
  demand(limits->total_min_mm <= limits->total_max_mm);
  demand(isfinite(limits->total_max_mm));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  fuzz_input input;
  lm_tolerance_link links[FUZZED_LINKS];
  lm_real worst_percent[FUZZED_LINKS];
  lm_real probable_percent[FUZZED_LINKS];
  static lm_real workspace[LM_SAMPLE_GAP_WORKSPACE(FUZZED_LOG2)];
  lm_tolerance_limits worst;
  lm_tolerance_limits probable;
  lm_gap_statistics statistics;
  lm_sampling_plan plan;
  lm_fault fault;
  lm_status status;
  lm_status worst_status;
  int count;
  int bounded = 1;
  int i;
  input.data = data;
  input.size = size;
  count = take_byte(&input) % (FUZZED_LINKS + 1);
  for (i = 0; i < count; i++) {
    links[i].influence = take_real(&input, (lm_real)0.01);
    links[i].lower_mm = take_real(&input, (lm_real)0.001);
    links[i].upper_mm = links[i].lower_mm + take_real(&input, (lm_real)0.001);
    links[i].distribution = (lm_distribution)(take_byte(&input) % 5);
    links[i].zone = (lm_gap_zone)(take_byte(&input) % 3);
    bounded = bounded && links[i].distribution != LM_NORMAL;
  }

  memset(&worst, UNTOUCHED, sizeof(worst));
  worst_status = lm_worst_limits(links, count, &worst, &fault);
  check_limits(worst_status, &worst);
  memset(&probable, UNTOUCHED, sizeof(probable));
  check_limits(
      lm_probable_limits(links, count, take_real(&input, (lm_real)0.001), &probable, &fault),
      &probable);

  status = lm_tolerance_contributions(links, count, worst_percent, probable_percent, &fault);
  demand(status == worst_status);
  for (i = 0; status == LM_OK && i < count; i++) {
    demand(worst_percent[i] >= 0 && worst_percent[i] <= (lm_real)100.001);
    demand(probable_percent[i] >= 0 && probable_percent[i] <= (lm_real)100.001);
  }

  plan.samples_log2 = take_byte(&input) % 8;
  plan.scramblings = take_byte(&input) % 5;
  take(&input, &plan.seed, sizeof(plan.seed));
  plan.low_probability = take_real(&input, (lm_real)1e-4);
  plan.high_probability = take_real(&input, (lm_real)1e-4);
  plan.limit_mm = take_real(&input, (lm_real)0.001);
  memset(&statistics, UNTOUCHED, sizeof(statistics));
  status = lm_sample_gap(links, count, &plan, workspace, sizeof(workspace) / sizeof(workspace[0]),
                         &statistics, &fault);
  if (status != LM_OK) {
    demand(untouched(&statistics, sizeof(statistics)));
    return 0;
  }
  demand(worst_status == LM_OK);
  demand(statistics.smallest_mm >= 0 && statistics.smallest_mm <= statistics.largest_mm);
  demand(statistics.low_mm.value <= statistics.median_mm.value);
  demand(statistics.median_mm.value <= statistics.high_mm.value);
  demand(statistics.reject_share.value >= 0 && statistics.reject_share.value <= 1);
  demand(statistics.closed_share.value >= 0 && statistics.closed_share.value <= 1);
  demand(isfinite(statistics.mean_mm.value) && statistics.mean_mm.standard_error >= 0);
  if (bounded) {
    /* Rounding of a sum of eight terms, each at most 100 * 10 mm. */
    const lm_real rounding = (lm_real)(LM_REAL_BITS == 64 ? 1e-11 : 1e-2);
    demand(statistics.smallest_mm >= worst.total_min_mm - rounding);
    demand(statistics.largest_mm <= worst.total_max_mm + rounding);
  }
  return 0;
}
