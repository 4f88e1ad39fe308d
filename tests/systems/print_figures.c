/* print_figures SPEC COUNT: figures and limits at COUNT points spread over a spec's ranges and
 * combinations, to 17 digits, one line a point: what two systems are compared by.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "spec.h"
#include "workspace.h"

#define TEXT_MAX (1 << 16)
#define GOLDEN_SHARE 0.6180339887498949 /* multiples of it spread evenly over 0 .. 1 */

static char text[TEXT_MAX];
static lm_problem problem;

int main(int count, char **argument) {
  static double result[LM_RESULT_MAX];
  double unit[LM_FREE_MAX] = {0};
  lm_spec_error error = {0, ""};
  lm_scan scan;
  lm_layout layout;
  lm_workspace *workspace = lm_create_workspace();
  FILE *file = count == 3 ? fopen(argument[1], "rb") : NULL;
  const int points = count == 3 ? atoi(argument[2]) : 0;
  int combinations;
  int i;
  if (workspace == NULL || file == NULL) {
    fputs("usage: print_figures SPEC COUNT\n", stderr);
    return 2;
  }
  text[fread(text, 1, TEXT_MAX - 1, file)] = '\0';
  fclose(file);
  if (lm_read_spec(text, &problem, &error) != LM_OK) {
    fprintf(stderr, "%s: line %d: %s\n", argument[1], error.line, error.text);
    return 2;
  }
  lm_default_scan(&scan);
  lm_lay_out(&problem, &scan, &layout);
  combinations = lm_count_combinations(&problem);
  for (i = 0; i < points; i++) {
    lm_status status;
    int k;
    for (k = 0; k < problem.range_count; k++) {
      unit[k] = fmod(GOLDEN_SHARE * (i + 1) * (k + 1), 1);
    }
    status = lm_evaluate_point(&problem, &scan, &layout, i % combinations, unit, result, workspace,
                               NULL);
    printf("%d", (int)status);
    for (k = 0; status == LM_OK && k < layout.count; k++) {
      printf(" %.17g", result[k]);
    }
    printf("\n");
  }
  lm_free_workspace(workspace);
  return 0;
}
