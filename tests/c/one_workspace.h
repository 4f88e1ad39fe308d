/* A problem, and the workspace in which each test evaluates its points. */
#ifndef LOSTMOTION_TESTS_ONE_WORKSPACE_H
#define LOSTMOTION_TESTS_ONE_WORKSPACE_H

#include "archive.h"
#include "test.h"
#include "workspace.h"

static lm_problem problem;
static lm_scan scan;
static lm_layout layout;
static lm_workspace *workspace;
static double result[LM_RESULT_MAX];

void setUp(void) {
  workspace = lm_create_workspace();
  TEST_ASSERT_NOT_NULL(workspace);
}

void tearDown(void) {
  lm_free_workspace(workspace);
}

#endif
