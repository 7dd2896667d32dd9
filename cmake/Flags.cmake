# Compiler flags, on interface targets that every target of ours links one of.
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
add_library(texel_plain_flags INTERFACE)
target_compile_features(texel_plain_flags INTERFACE cxx_std_20)
# No contraction and no fast-math: the same bytes from g++ and clang++, with or without FMA.
target_compile_options(texel_plain_flags INTERFACE -Wall -Wextra -Wshadow -Wconversion -ffp-contract=off)
# Every x86-64 processor since 2009 counts bits in one instruction; without this each count is a function call.
set(TEXEL_MARCH "x86-64-v2" CACHE STRING "Processor level on x86-64; empty: the compiler's own")
if(TEXEL_MARCH AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  target_compile_options(texel_plain_flags INTERFACE -march=${TEXEL_MARCH})
endif()
target_include_directories(texel_plain_flags INTERFACE "${PROJECT_SOURCE_DIR}")
# Thin wrappers of large header libraries (the modules) link the plain flags: with sanitizers one of them takes four minutes to compile,
# nearly all of it the library's own code.
add_library(texel_flags INTERFACE)
target_link_libraries(texel_flags INTERFACE texel_plain_flags)
if(TEXEL_SANITIZE)
  target_compile_options(texel_flags INTERFACE -fsanitize=${TEXEL_SANITIZE} -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
  target_link_options(texel_flags INTERFACE -fsanitize=${TEXEL_SANITIZE})
endif()
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
