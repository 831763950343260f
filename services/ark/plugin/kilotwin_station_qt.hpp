/// For sources of ARK that are to stay nearly as they are: the words of Qt that its experiments use, without Qt.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "kilotwin_station.hpp"

#define Q_OBJECT
#define emit
#define signals public
#define slots
#define SIGNAL(name) 0
#define SLOT(name) 0

class QObject {
 public:
  explicit QObject(QObject* = nullptr) {}
  virtual ~QObject() = default;
  /// Connections of environments to the station exist by themselves.
  template <class... Any> static void connect(Any&&...) {}
};

using QPointF = kilotwin::station::Point;
using QString = std::string;
template <class T> using QVector = std::vector<T>;

inline double qDegreesToRadians(double degrees) { return degrees * (3.14159265358979323846 / 180); }
inline double qRadiansToDegrees(double radians) { return radians * (180 / 3.14159265358979323846); }
