/* The wall clock of a process, ahead by the seconds (a double) in the file $WALL_CLOCK_AHEAD. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>

#define SLICE 1000000 /* ns, until a wait takes notice of a clock that was set */

static double ahead(void) {
    static volatile double *shared;
    if (!shared)
        shared = mmap(NULL, sizeof(double), PROT_READ, MAP_SHARED, open(getenv("WALL_CLOCK_AHEAD"), O_RDONLY), 0);
    return *shared;
}

static struct timespec later(struct timespec time, long long ns) {
    long long sum = time.tv_sec * 1000000000LL + time.tv_nsec + ns;
    return (struct timespec){sum / 1000000000LL, sum % 1000000000LL};
}

int clock_gettime(clockid_t id, struct timespec *time) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int failed = real(id, time);
    if (id == CLOCK_REALTIME) *time = later(*time, (long long)(1e9 * ahead()));
    return failed;
}

int pthread_cond_timedwait(pthread_cond_t *condition, pthread_mutex_t *mutex, const struct timespec *end) {
    static int (*real)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
    if (!real) real = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
    if (end->tv_sec < 1000000000) return real(condition, mutex, end); /* of the steady clock */
    for (;;) {
        struct timespec now;
        clock_gettime(CLOCK_REALTIME, &now);
        long long left = (end->tv_sec - now.tv_sec) * 1000000000LL + end->tv_nsec - now.tv_nsec;
        if (left <= 0) return ETIMEDOUT;
        now = later(now, (long long)(-1e9 * ahead()) + (left < SLICE ? left : SLICE));
        int result = real(condition, mutex, &now);
        if (result != ETIMEDOUT) return result;
    }
}
