/// The parts of a camera's picture that stand still: floor, walls, obstacles, under room light and through the lens.
#pragma once

#include <opencv2/core.hpp>

#include "clients/cameras/camera_model.hpp"
#include "clients/cameras/robot_look.hpp"
#include "core/plan/world.hpp"

namespace kilotwin::cameras {

/// The picture without robots and movable bodies, CV_8UC3, with the camera's gain. Edges are anti-aliased.
[[nodiscard]] cv::Mat paint_background(const World& world, const CameraModel& camera, const Look& look);

/// Draws a movable body (its shape, where it stands) into a picture of the camera.
void paint_movable(cv::Mat& picture, const Convex& shape, const Pose& pose, const CameraModel& camera,
                   const Look& look);

}  // namespace kilotwin::cameras
