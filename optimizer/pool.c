#if !defined(_WIN32)
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>
#include <unistd.h>
#endif

#include "pool.h"

#include <stdlib.h>
#include <string.h>

#include "stop.h"

struct lm_pool {
  int workers;
  lm_workspace *workspace[LM_WORKERS_MAX];
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
#if !defined(_WIN32)
  pthread_mutex_t lock;
#endif
} run;

typedef struct worker {
  run *shared;
  lm_workspace *workspace;
} worker;

static void lock(run *r) {
#if !defined(_WIN32)
  (void)pthread_mutex_lock(&r->lock);
#else
  (void)r;
#endif
}

static void unlock(run *r) {
#if !defined(_WIN32)
  (void)pthread_mutex_unlock(&r->lock);
#else
  (void)r;
#endif
}

static int is_stopped(const run *r) {
  return r->failed || lm_is_stopped(r->stop);
}

/* The next task to do, copied while the lock is held: the last answer may end the batch. */
static int take_task(run *r, lm_task *task) {
  int taken = 0;
  lock(r);
  while (!taken && r->next < r->count && !is_stopped(r)) {
    *task = r->tasks[r->next++];
    taken = r->skip == NULL || !r->skip(r->context, task->id);
  }
  unlock(r);
  return taken;
}

static void *work(void *data) {
  worker *w = (worker *)data;
  run *r = w->shared;
  lm_answer *answer = (lm_answer *)malloc(sizeof *answer);
  lm_task task;
  while (answer != NULL && take_task(r, &task)) {
    const lm_status status = lm_run_task(r->problem, &task, answer, w->workspace, r->stop);
    lock(r);
    if (status == LM_OK) {
      r->sink(r->context, answer);
    } else {
      r->failed = 1;
    }
    unlock(r);
  }
  if (answer == NULL) {
    lock(r);
    r->failed = 1;
    unlock(r);
  }
  free(answer);
  return NULL;
}

static int count_cores(void) {
#if defined(_SC_NPROCESSORS_ONLN)
  const long cores = sysconf(_SC_NPROCESSORS_ONLN);
  return cores < 1 ? 1 : cores > LM_WORKERS_MAX ? LM_WORKERS_MAX : (int)cores;
#else
  return 1;
#endif
}

lm_pool *lm_open_pool(int workers) {
  lm_pool *pool = (lm_pool *)calloc(1, sizeof *pool);
  int i;
  if (pool == NULL) {
    return NULL;
  }
  pool->workers = workers == 0 ? count_cores() : workers;
  if (pool->workers < 1 || pool->workers > LM_WORKERS_MAX) {
    free(pool);
    return NULL;
  }
  for (i = 0; i < pool->workers; i++) {
    pool->workspace[i] = lm_create_workspace();
    if (pool->workspace[i] == NULL) {
      lm_close_pool(pool);
      return NULL;
    }
  }
  return pool;
}

void lm_close_pool(lm_pool *pool) {
  int i;
  if (pool != NULL) {
    for (i = 0; i < pool->workers; i++) {
      lm_free_workspace(pool->workspace[i]);
    }
    free(pool);
  }
}

lm_status lm_run_tasks(lm_pool *pool, const lm_problem *problem, const lm_task tasks[], int count,
                       int (*skip)(void *context, int id), lm_answer_sink sink, void *context,
                       const volatile int *stop) {
  run r;
  worker w[LM_WORKERS_MAX];
  int i;
  memset(&r, 0, sizeof r);
  r.problem = problem;
  r.tasks = tasks;
  r.count = count;
  r.skip = skip;
  r.sink = sink;
  r.context = context;
  r.stop = stop;
  for (i = 0; i < pool->workers; i++) {
    w[i].shared = &r;
    w[i].workspace = pool->workspace[i];
  }
#if !defined(_WIN32)
  {
    pthread_t thread[LM_WORKERS_MAX];
    int started = 0;
    (void)pthread_mutex_init(&r.lock, NULL);
    /* The calling thread works too; it alone when no other can be started. */
    for (i = 1; i < pool->workers && i < count; i++) {
      if (pthread_create(&thread[started], NULL, work, &w[i]) == 0) {
        started++;
      }
    }
    (void)work(&w[0]);
    for (i = 0; i < started; i++) {
      (void)pthread_join(thread[i], NULL);
    }
    (void)pthread_mutex_destroy(&r.lock);
  }
#else
  (void)work(&w[0]);
#endif
  if (lm_is_stopped(stop)) {
    return LM_NOT_CONVERGED;
  }
  return r.failed ? LM_TOO_SMALL : LM_OK;
}
