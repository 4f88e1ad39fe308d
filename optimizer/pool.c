#include "pool.h"

#include <stdlib.h>
#include <string.h>

#include "platform.h"
#include "stop.h"
#include "workspace.h"

struct lm_pool {
  int workers;
  lm_workspace *workspace[LM_WORKERS_MAX];
  lm_known_gaps *known_gaps;
  lm_lock *lock;
};

/* One run over a batch, shared by the threads. */
typedef struct run {
  const lm_problem *problem;
  const lm_task *tasks;
  int count;
  int next; /* first task not taken */
  int failed;
  lm_answer_sink sink;
  void *context;
  int (*skip)(void *context, int id);
  const volatile int *stop;
  lm_lock *lock;
} run;

typedef struct worker {
  run *shared;
  lm_workspace *workspace;
} worker;

static int is_stopped(const run *r) {
  return r->failed || lm_is_stopped(r->stop);
}

/* The next task to do, copied while the lock is held: the last answer may end the batch. */
static int take_task(run *r, lm_task *task) {
  int taken = 0;
  lm_acquire(r->lock);
  while (!taken && r->next < r->count && !is_stopped(r)) {
    *task = r->tasks[r->next++];
    taken = r->skip == NULL || !r->skip(r->context, task->id);
  }
  lm_release(r->lock);
  return taken;
}

static void work(void *data) {
  worker *w = (worker *)data;
  run *r = w->shared;
  lm_answer *answer = (lm_answer *)malloc(sizeof *answer);
  lm_task task;
  while (answer != NULL && take_task(r, &task)) {
    const lm_status status = lm_run_task(r->problem, &task, answer, w->workspace, r->stop);
    lm_acquire(r->lock);
    if (status == LM_OK) {
      r->sink(r->context, answer);
    } else {
      r->failed = 1;
    }
    lm_release(r->lock);
  }
  if (answer == NULL) {
    lm_acquire(r->lock);
    r->failed = 1;
    lm_release(r->lock);
  }
  free(answer);
}

lm_pool *lm_open_pool(int workers) {
  lm_pool *pool = (lm_pool *)calloc(1, sizeof *pool);
  int i;
  if (pool == NULL) {
    return NULL;
  }
  if (workers == 0) {
    const int cores = lm_count_cores();
    workers = cores > LM_WORKERS_MAX ? LM_WORKERS_MAX : cores;
  }
  pool->workers = workers;
  if (pool->workers < 1 || pool->workers > LM_WORKERS_MAX) {
    free(pool);
    return NULL;
  }
  pool->lock = lm_create_lock();
  pool->known_gaps = lm_create_known_gaps();
  if (pool->lock == NULL || pool->known_gaps == NULL) {
    lm_close_pool(pool);
    return NULL;
  }
  for (i = 0; i < pool->workers; i++) {
    pool->workspace[i] = lm_create_workspace();
    if (pool->workspace[i] == NULL) {
      lm_close_pool(pool);
      return NULL;
    }
    pool->workspace[i]->known_gaps = pool->known_gaps;
  }
  return pool;
}

void lm_close_pool(lm_pool *pool) {
  int i;
  if (pool != NULL) {
    for (i = 0; i < pool->workers; i++) {
      lm_free_workspace(pool->workspace[i]);
    }
    lm_free_known_gaps(pool->known_gaps);
    lm_free_lock(pool->lock);
    free(pool);
  }
}

lm_status lm_run_tasks(lm_pool *pool, const lm_problem *problem, const lm_task tasks[], int count,
                       int (*skip)(void *context, int id), lm_answer_sink sink, void *context,
                       const volatile int *stop) {
  run r;
  worker w[LM_WORKERS_MAX];
  lm_thread *thread[LM_WORKERS_MAX];
  int started = 0;
  int i;
  memset(&r, 0, sizeof r);
  r.problem = problem;
  r.tasks = tasks;
  r.count = count;
  r.skip = skip;
  r.sink = sink;
  r.context = context;
  r.stop = stop;
  r.lock = pool->lock;
  for (i = 0; i < pool->workers; i++) {
    w[i].shared = &r;
    w[i].workspace = pool->workspace[i];
  }
  /* The calling thread works too, alone if no other can be started. */
  for (i = 1; i < pool->workers && i < count; i++) {
    thread[started] = lm_start_thread(work, &w[i]);
    started += thread[started] != NULL;
  }
  work(&w[0]);
  for (i = 0; i < started; i++) {
    lm_join_thread(thread[i]);
  }
  if (lm_is_stopped(stop)) {
    return LM_NOT_CONVERGED;
  }
  return r.failed ? LM_TOO_SMALL : LM_OK;
}
