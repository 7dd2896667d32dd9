# Outside libraries. The order and the odd guards are needed on Debian 12; each has its reason beside it.
# Debian's Imath config reports its Python part, which nobody asked for, as if an installation were broken: only warnings are shown here.
set(_texel_level "${CMAKE_MESSAGE_LOG_LEVEL}")
set(CMAKE_MESSAGE_LOG_LEVEL WARNING)
set(_texel_modules "${CMAKE_MODULE_PATH}")
set(_texel_shared "${BUILD_SHARED_LIBS}")

find_package(Threads REQUIRED)
find_package(TBB CONFIG REQUIRED)        # before OpenVDB and CGAL, whose own find modules clash with TBB's config
find_package(Imath 3.1 CONFIG REQUIRED)
find_package(embree 3.13 CONFIG REQUIRED)
find_package(PNG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(EXPAT 2.4 REQUIRED)        # earlier ones have no bound on what entities grow to
find_path(LIBDEFLATE_INCLUDE_DIR libdeflate.h REQUIRED)   # its package has no CMake config
find_library(LIBDEFLATE_LIBRARY deflate REQUIRED)
add_library(texel_libdeflate INTERFACE)
target_include_directories(texel_libdeflate SYSTEM INTERFACE "${LIBDEFLATE_INCLUDE_DIR}")
target_link_libraries(texel_libdeflate INTERFACE "${LIBDEFLATE_LIBRARY}")
find_package(OpenSSL REQUIRED COMPONENTS Crypto)
find_package(nlohmann_json 3.11 CONFIG REQUIRED)
find_package(CLI11 2.1 CONFIG REQUIRED)
find_package(draco 1.5 CONFIG REQUIRED)
find_package(meshoptimizer 0.18 CONFIG REQUIRED)

# OpenImageIO by hand: its CMake config demands its tools and OpenCV's headers, which its -dev package does not bring.
find_path(OIIO_INCLUDE_DIR OpenImageIO/imageio.h REQUIRED)
find_library(OIIO_LIBRARY OpenImageIO REQUIRED)
find_library(OIIO_UTIL_LIBRARY OpenImageIO_Util REQUIRED)
add_library(texel_oiio INTERFACE)
target_include_directories(texel_oiio SYSTEM INTERFACE "${OIIO_INCLUDE_DIR}")
target_link_libraries(texel_oiio INTERFACE "${OIIO_LIBRARY}" "${OIIO_UTIL_LIBRARY}" Imath::Imath)

# OpenVDB ships a find module only, outside CMake's default path.
list(APPEND CMAKE_MODULE_PATH "/usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB")
find_package(OpenVDB 10 REQUIRED COMPONENTS openvdb)

if(TEXEL_EXACT)
  find_package(CGAL 5.5 CONFIG QUIET)
  if(NOT CGAL_FOUND)
    message(WARNING "texel: CGAL not found, building without the exact geometry target")
    set(TEXEL_EXACT OFF)
  endif()
endif()
if(TEXEL_TESTS)
  find_package(GTest REQUIRED)
  find_package(OpenMesh CONFIG QUIET)    # an independent reader, used as a check in the tests
endif()
if(TEXEL_BENCH)
  find_package(benchmark REQUIRED)
endif()

# OpenVDB's find module sets BUILD_SHARED_LIBS and CGAL's changes the module path for everybody: put both back.
set(CMAKE_MODULE_PATH "${_texel_modules}")
set(BUILD_SHARED_LIBS "${_texel_shared}")
set(CMAKE_MESSAGE_LOG_LEVEL "${_texel_level}")
