// SPDX-License-Identifier: Apache-2.0
// How the C library keeps memory: for work that makes and drops arrays of hundreds of megabytes, and for
// servers.
#pragma once

namespace ecorche::platform {

/// From now on freed memory stays with the process, and comes in huge pages where the kernel gives them on
/// request. By default every large array is mapped when it is made and unmapped when it is dropped, and the
/// kernel clears its pages one by one: a fifth of a preparation's time. The process' peak stays what it was;
/// it is not lower in between. To be called before other threads start, by programs that end when the work is
/// done. Does nothing where the C library is not glibc.
void use_big_heap();

/// From now on all threads share one heap, and every array of 256 KiB or more is mapped when it is made and
/// unmapped when it is dropped. By default each thread has a heap of its own, and what one took and another
/// gave back stays where it was, and arrays of megabytes come to lie between small things that stay: a
/// server's memory creeps up for hours until every heap has seen every load. To be called before other
/// threads start. Does nothing where the C library is not glibc.
void use_tidy_heap();

/// Has the system take back the pages of the heap that hold nothing, wherever in it they lie: after work that
/// made much and dropped it again while things that stay were made in between. Without it such pages stay,
/// and the next work of that kind, which finds other gaps than the last one, adds some more. Other threads
/// that ask for memory wait meanwhile. Does nothing where the C library is not glibc.
void give_back_heap();

/// Lets the kernel keep one copy of what this process and others that ask for it have alike, page by page,
/// and give each a copy of its own where it writes (KSM). It does so where its administrator has switched
/// that on, beside all else. Who shares a page with another process can find out by timing that it does: only
/// for those that may know of each other. False where the kernel cannot (before Linux 6.4).
bool merge_equal_pages();

}  // namespace ecorche::platform
