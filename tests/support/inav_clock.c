/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Preloaded into INAV's SITL: its clock goes only as far as the test lets it, so that a flight is the same on a busy
 * machine. INAV_CLOCK is the path of a file with two numbers of 8 bytes, microseconds: the time, and its limit.
 */
#define _GNU_SOURCE
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

/* Each look at the clock takes this long, so that a loop that waits comes to an end. */
#define LOOK_US 2

static volatile uint64_t *shared;

__attribute__((constructor)) static void map_clock(void)
{
    const char *path = getenv("INAV_CLOCK");
    int file = path ? open(path, O_RDWR) : -1;
    void *page = file < 0 ? MAP_FAILED : mmap(NULL, 16, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);

    if (page == MAP_FAILED)
        _exit(3);
    shared = page;
}

static int is_main_thread(void)
{
    return syscall(SYS_gettid) == getpid();
}

static void pass(uint64_t us)
{
    const struct timespec wait = {0, 100000};

    shared[0] += us;
    while (shared[0] >= shared[1])
        syscall(SYS_nanosleep, &wait, NULL);
}

int clock_gettime(clockid_t which, struct timespec *now)
{
    if (which != CLOCK_MONOTONIC)
        return syscall(SYS_clock_gettime, which, now);
    if (is_main_thread())
        pass(LOOK_US);
    now->tv_sec = shared[0] / 1000000;
    now->tv_nsec = shared[0] % 1000000 * 1000;
    return 0;
}

int usleep(useconds_t us)
{
    const struct timespec wait = {us / 1000000, us % 1000000 * 1000};

    if (!is_main_thread())
        return syscall(SYS_nanosleep, &wait, NULL);
    pass(us);
    return 0;
}
