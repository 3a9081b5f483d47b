# The libraries, for the build and for users of the installed package alike. packages.txt names the
# Debian packages that bring them.
find_package(Threads REQUIRED)
find_package(ZLIB REQUIRED)
find_package(PNG REQUIRED)
find_package(JPEG REQUIRED)
find_package(TIFF REQUIRED)
find_package(OpenEXR CONFIG REQUIRED)
find_package(Eigen3 CONFIG REQUIRED)
find_package(embree 3 CONFIG REQUIRED)
find_package(TBB CONFIG REQUIRED)
find_package(tomlplusplus CONFIG REQUIRED)
find_package(fmt CONFIG REQUIRED)
find_package(nlohmann_json CONFIG REQUIRED)
find_package(Ceres CONFIG REQUIRED)
find_package(Boost REQUIRED)
# OpenCV's CMake config comes with all of OpenCV; its image filters alone are one small package.
find_path(TRUEBOX_OPENCV_INCLUDE opencv2/imgproc.hpp PATH_SUFFIXES opencv4 REQUIRED)
find_library(TRUEBOX_OPENCV_IMGPROC opencv_imgproc REQUIRED)
find_library(TRUEBOX_OPENCV_CORE opencv_core REQUIRED)
if(NOT TARGET opencv_imgproc)
  add_library(opencv_imgproc INTERFACE IMPORTED)
  target_include_directories(opencv_imgproc SYSTEM INTERFACE ${TRUEBOX_OPENCV_INCLUDE})
  target_link_libraries(opencv_imgproc INTERFACE
    ${TRUEBOX_OPENCV_IMGPROC} ${TRUEBOX_OPENCV_CORE})
endif()
# The same for response curves from exposure series (photo).
find_path(TRUEBOX_OPENCV_PHOTO_INCLUDE opencv2/photo.hpp PATH_SUFFIXES opencv4 REQUIRED)
find_library(TRUEBOX_OPENCV_PHOTO opencv_photo REQUIRED)
if(NOT TARGET opencv_photo)
  add_library(opencv_photo INTERFACE IMPORTED)
  target_include_directories(opencv_photo SYSTEM INTERFACE ${TRUEBOX_OPENCV_PHOTO_INCLUDE})
  target_link_libraries(opencv_photo INTERFACE
    ${TRUEBOX_OPENCV_PHOTO} ${TRUEBOX_OPENCV_IMGPROC} ${TRUEBOX_OPENCV_CORE})
endif()
# And for finding a ColorChecker (mcc); its header includes that of dnn.
find_path(TRUEBOX_OPENCV_MCC_INCLUDE opencv2/mcc.hpp PATH_SUFFIXES opencv4 REQUIRED)
find_library(TRUEBOX_OPENCV_MCC opencv_mcc REQUIRED)
if(NOT TARGET opencv_mcc)
  add_library(opencv_mcc INTERFACE IMPORTED)
  target_include_directories(opencv_mcc SYSTEM INTERFACE ${TRUEBOX_OPENCV_MCC_INCLUDE})
  target_link_libraries(opencv_mcc INTERFACE ${TRUEBOX_OPENCV_MCC} ${TRUEBOX_OPENCV_CORE})
endif()
# Chessboard corners, likewise; it needs the filters for their sub-pixel positions.
find_library(TRUEBOX_OPENCV_CALIB3D opencv_calib3d REQUIRED)
if(NOT TARGET opencv_calib3d)
  add_library(opencv_calib3d INTERFACE IMPORTED)
  target_link_libraries(opencv_calib3d INTERFACE ${TRUEBOX_OPENCV_CALIB3D} opencv_imgproc)
endif()
# Debian puts this config into /usr/share/cmake itself, where find_package does not look.
find_package(OpenColorIO CONFIG REQUIRED PATHS /usr/share/cmake NO_DEFAULT_PATH)
# Debian's OpenColorIO 2.1.2 config was moved without its prefix and names the folder "/include",
# which does not exist; its headers lie in the compiler's own search path.
if(NOT EXISTS /include)
  get_target_property(ocio_include OpenColorIO::OpenColorIO INTERFACE_INCLUDE_DIRECTORIES)
  if(ocio_include STREQUAL "/include")
    set_target_properties(OpenColorIO::OpenColorIO PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "")
  endif()
endif()
