# What `cmake --install` lays down. The program looks for its modules in ../lib/texel, so the whole prefix may be moved.
include(CMakePackageConfigHelpers)

# Not CMAKE_INSTALL_LIBDIR: Debian's lib/x86_64-linux-gnu is where neither the program looks (module.cpp) nor, in a project
# without a compiled language, find_package.
set(_texel_module_dir "lib/texel")
set(_texel_config_dir "lib/cmake/texel")

install(TARGETS texel EXPORT texelTargets RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
install(TARGETS texel_image texel_vdb LIBRARY DESTINATION "${_texel_module_dir}")
install(EXPORT texelTargets NAMESPACE texel:: DESTINATION "${_texel_config_dir}")

configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/texelConfig.cmake.in" "${PROJECT_BINARY_DIR}/texelConfig.cmake"
  INSTALL_DESTINATION "${_texel_config_dir}")
# The program is run, not linked: the pointer size of the consumer does not matter.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/texelConfigVersion.cmake" COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES "${PROJECT_BINARY_DIR}/texelConfig.cmake" "${PROJECT_BINARY_DIR}/texelConfigVersion.cmake" cmake/TexelAddPack.cmake
  DESTINATION "${_texel_config_dir}")

install(FILES README.md CHANGELOG.md LICENSE DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(DIRECTORY docs/ DESTINATION "${CMAKE_INSTALL_DOCDIR}/docs")
