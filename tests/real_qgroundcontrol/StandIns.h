// SPDX-License-Identifier: GPL-3.0-or-later
// What QGroundControl's code needs of its windows, settings, links, cameras and maps, as far as a session uses it.

#pragma once

#include <QtCore/QtCore>
#include <QtGui/QImage>
#include <QtQml/QtQml>
#include <QtNetwork/QUdpSocket>
#include <QtPositioning/QGeoCoordinate>
#include <QtPositioning/QGeoPositionInfo>
#include <QtQmlIntegration/QtQmlIntegration>
#include <functional>
#include <memory>

#include "FactGroup.h"
#include "MAVLinkLib.h"
#include "QmlObjectListModel.h"

class Vehicle;

#define QGC_LOGGING_CATEGORY(name, text) Q_LOGGING_CATEGORY(name, text, QtWarningMsg)
#define ONE(type) static type *instance() { static type one; return &one; }

/// What the pilot would see and hear, a line for each: kind, tab, text.
void tell(const QString &kind, QString text);

class QGCImageProvider { public: void setImage(const QImage &, int) {} };

class QGCApplication : public QCoreApplication {
    Q_OBJECT
public:
    using QCoreApplication::QCoreApplication;
    bool runningUnitTests() const { return false; }
    void showAppMessage(const QString &text, const QString & = QString()) { tell("dialog", text); }
    void showRebootAppMessage(const QString &text, const QString & = QString()) { tell("dialog", text); }
    /// The banner over the map.
    void showCriticalVehicleMessage(const QString &text) { tell("banner", text); }
    void reportMissingParameter(int, const QString &name) { tell("dialog", "missing parameter " + name); }
    uint64_t msecsSinceBoot() { return 0; }
    QGCImageProvider *qgcImageProvider() { return nullptr; }
};
inline QGCApplication *qgcApp() { return static_cast<QGCApplication *>(QCoreApplication::instance()); }

class AudioOutput { public: ONE(AudioOutput) void say(const QString &text) { tell("voice", text); } };

// Settings.
#define SETTING(name) Fact *name() { static Fact fact(0, #name, FactMetaData::valueTypeDouble); return &fact; }
struct AppSettings {
    SETTING(offlineEditingCruiseSpeed) SETTING(offlineEditingHoverSpeed) SETTING(offlineEditingFirmwareClass)
    SETTING(offlineEditingVehicleClass)
    QString telemetrySavePath() { return {}; }
};
struct FlyViewSettings { 
    SETTING(updateHomePosition) SETTING(requestControlTimeout)
    Fact *maxGoToLocationDistance() {
        static Fact fact(0, "maxGoToLocationDistance", FactMetaData::valueTypeDouble);
        fact.setRawValue(1e7);
        return &fact;
    }
};
struct MavlinkSettings { SETTING(telemetrySaveNotArmed) SETTING(saveCsvTelemetry) SETTING(apmStartMavlinkStreams) };
struct PlanViewSettings { SETTING(useConditionGate) };
struct VideoSettings {
    static constexpr int videoDisabled = 1, videoSourceUDPH264 = 2, videoSource3DRSolo = 3;
    SETTING(videoSource) SETTING(lowLatencyMode) SETTING(streamEnabled) SETTING(disableWhenDisarmed)
};
struct APMMavlinkStreamRateSettings {
    SETTING(streamRateRawSensors) SETTING(streamRateExtendedStatus) SETTING(streamRateRCChannels) SETTING(streamRatePosition)
    SETTING(streamRateExtra1) SETTING(streamRateExtra2) SETTING(streamRateExtra3)
};
class UnitsSettings : public QObject {
    Q_OBJECT
public:
    enum HorizontalDistanceUnits { HorizontalDistanceUnitsFeet, HorizontalDistanceUnitsMeters };
    enum VerticalDistanceUnits { VerticalDistanceUnitsFeet, VerticalDistanceUnitsMeters };
    enum AreaUnits { AreaUnitsSquareFeet, AreaUnitsSquareMeters, AreaUnitsSquareKilometers, AreaUnitsHectares, AreaUnitsAcres,
        AreaUnitsSquareMiles };
    enum SpeedUnits { SpeedUnitsFeetPerSecond, SpeedUnitsMetersPerSecond, SpeedUnitsMilesPerHour, SpeedUnitsKilometersPerHour,
        SpeedUnitsKnots };
    enum TemperatureUnits { TemperatureUnitsCelsius, TemperatureUnitsFarenheit };
    enum WeightUnits { WeightUnitsGrams, WeightUnitsKg, WeightUnitsOz, WeightUnitsLbs };
    SETTING(horizontalDistanceUnits) SETTING(verticalDistanceUnits) SETTING(areaUnits) SETTING(speedUnits)
    SETTING(temperatureUnits) SETTING(weightUnits)
};
class SettingsManager {
public:
    ONE(SettingsManager)
#define GROUP(type, name) type *name() { static type group; return &group; }
    GROUP(AppSettings, appSettings) GROUP(FlyViewSettings, flyViewSettings) GROUP(MavlinkSettings, mavlinkSettings)
    GROUP(PlanViewSettings, planViewSettings) GROUP(VideoSettings, videoSettings) GROUP(UnitsSettings, unitsSettings)
    GROUP(APMMavlinkStreamRateSettings, apmMavlinkStreamRateSettings)
    static void adjustSettingMetaData(const QString &, FactMetaData &, bool &) {}
};

// The link.
class LinkConfiguration {
public:
    enum LinkType { TypeUdp };
    bool isHighLatency() const { return false; }
    bool isForwarding() const { return false; }
    QString name() const { return "UDP"; }
    LinkType type() const { return TypeUdp; }
};
using SharedLinkConfigurationPtr = std::shared_ptr<LinkConfiguration>;

/// A UDP port, which answers every address that ever sent.
class LinkInterface : public QObject {
    Q_OBJECT
public:
    explicit LinkInterface(int port);
    bool isConnected() const { return true; }
    bool isLogReplay() const { return false; }
    bool isSecureConnection() const { return false; }
    uint8_t mavlinkChannel() const { return 0; }
    SharedLinkConfigurationPtr linkConfiguration() const { return _configuration; }
    void writeBytesThreadSafe(const char *bytes, int length);
    void addVehicleReference() {}
    void removeVehicleReference() {}
    void reportMavlinkV1Traffic() { tell("v1", ""); }
signals:
    void disconnected();
private:
    void _read();
    QUdpSocket _socket;
    QSet<QPair<QHostAddress, quint16>> _peers;
    SharedLinkConfigurationPtr _configuration = std::make_shared<LinkConfiguration>();
};
using SharedLinkInterfacePtr = std::shared_ptr<LinkInterface>;
using WeakLinkInterfacePtr = std::weak_ptr<LinkInterface>;

class LinkManager {
public:
    ONE(LinkManager)
    SharedLinkInterfacePtr link;
    SharedLinkInterfacePtr sharedLinkInterfacePointerForLink(LinkInterface *) { return link; }
    static uint8_t invalidMavlinkChannel() { return 255; }
    uint8_t allocateMavlinkChannel() { return 1; }
    static bool isLinkUSBDirect(const LinkInterface *) { return false; }
};

class MAVLinkProtocol : public QObject {
    Q_OBJECT
public:
    ONE(MAVLinkProtocol)
    int getSystemId() const { return 255; }
    static int getComponentId() { return MAV_COMP_ID_MISSIONPLANNER; }
    void receiveBytes(LinkInterface *link, const QByteArray &data);
signals:
    void messageReceived(LinkInterface *link, const mavlink_message_t &message);
    void mavlinkMessageStatus(int sysid, uint64_t totalSent, uint64_t totalReceived, uint64_t totalLoss, float lossPercent);
};

class MultiVehicleManager : public QObject {
    Q_OBJECT
public:
    ONE(MultiVehicleManager)
    /// The first heartbeat of an autopilot makes the vehicle.
    void heartbeat(LinkInterface *link, const mavlink_message_t &message);
    QmlObjectListModel *vehicles() { return &_vehicles; }
    Vehicle *vehicle = nullptr;
signals:
    void activeVehicleChanged(Vehicle *vehicle);
    void parameterReadyVehicleAvailableChanged(bool available);
private:
    QmlObjectListModel _vehicles;
};

// Missions.
class MissionCommandUIInfo {
public:
    bool isStandaloneCoordinate() const { return false; }
    bool specifiesCoordinate() const { return true; }
    bool isTakeoffCommand() const { return false; }
};
class MissionCommandTree {
public:
    ONE(MissionCommandTree)
    QString rawName(MAV_CMD command) { return QString::number(command); }
    QString friendlyName(MAV_CMD) { return {}; }
    const MissionCommandUIInfo *getUIInfo(Vehicle *, int, MAV_CMD) { static MissionCommandUIInfo info; return &info; }
};
struct MissionCommandList { static constexpr const char *qgcFileType = "MavCmdInfo"; };
class QGCFencePolygon {
public:
    explicit QGCFencePolygon(bool inclusion = true) : _inclusion(inclusion) {}
    int count() const { return _path.count(); }
    QVariantList path() const { return _path; }
    bool inclusion() const { return _inclusion; }
    void setInclusion(bool inclusion) { _inclusion = inclusion; }
    void appendVertex(const QGeoCoordinate &vertex) { _path.append(QVariant::fromValue(vertex)); }
    void clear() { _path.clear(); }
private:
    QVariantList _path;
    bool _inclusion;
};
class QGCFenceCircle {
public:
    QGCFenceCircle(const QGeoCoordinate &center, double radius, bool inclusion) : _center(center), _inclusion(inclusion) {
        _radius = std::make_shared<Fact>(0, "radius", FactMetaData::valueTypeDouble);
        _radius->setRawValue(radius);
    }
    QGeoCoordinate center() const { return _center; }
    bool inclusion() const { return _inclusion; }
    Fact *radius() { return _radius.get(); }
private:
    QGeoCoordinate _center;
    std::shared_ptr<Fact> _radius;
    bool _inclusion;
};
class FactValueSliderListModel : public QObject {
    Q_OBJECT
public:
    explicit FactValueSliderListModel(Fact &) {}
};
class QGCMapCircle : public QObject {
    Q_OBJECT
public:
    SETTING(radius)
    bool clockwiseRotation() { return true; }
    void setClockwiseRotation(bool) {}
    void setShowRotation(bool) {}
    QGeoCoordinate center() { return {}; }
    void setCenter(const QGeoCoordinate &) {}
};

// The setup pages. Their checks of ArduPilot's parameters are not part of a session.
class VehicleComponent {};
class AutoPilotPlugin : public QObject {
    Q_OBJECT
public:
    explicit AutoPilotPlugin(Vehicle *, QObject *parent = nullptr) : QObject(parent) {}
    void parametersReadyPreChecks() {}
    bool setupComplete() const { return true; }
};
using APMAutoPilotPlugin = AutoPilotPlugin;
using GenericAutoPilotPlugin = AutoPilotPlugin;
class APMParameterMetaData : public QObject {
    Q_OBJECT
public:
    using QObject::QObject;
    void loadParameterFactMetaDataFile(const QString &) {}
    FactMetaData *getMetaDataForFact(const QString &, MAV_TYPE, FactMetaData::ValueType_t type) { return new FactMetaData(type, this); }
    static void getParameterMetaDataVersionInfo(const QString &, int &, int &) {}
};

// Component metadata: the daemon has none.
class CompInfoParam : public QObject {
    Q_OBJECT
public:
    using QObject::QObject;
    FactMetaData *factMetaDataForName(const QString &, FactMetaData::ValueType_t type) { return new FactMetaData(type, this); }
};
class ComponentInformationManager : public QObject {
    Q_OBJECT
public:
    ComponentInformationManager(Vehicle *, QObject *parent) : QObject(parent) {}
    using Done = void (*)(void *);
    void requestAllComponentInformation(Done done, void *data) { done(data); }
    CompInfoParam *compInfoParam(uint8_t) { return &_parameters; }
signals:
    void progressUpdate(float progress);
private:
    CompInfoParam _parameters;
};

// The rest is idle: a vehicle has it, but a session does not use it.
struct MavlinkCameraControl {};
struct VehicleCameraControl : MavlinkCameraControl { template <typename... Any> VehicleCameraControl(Any...) {} };
class QGCFileDownload : public QObject {
    Q_OBJECT
public:
    using QObject::QObject;
    bool start(const QString &) { return false; }
signals:
    void finished(bool success, const QString &localFile, const QString &errorMsg);
};
class QGCOptions { public: bool checkFirmwareVersion() { return false; } };
class QGCCorePlugin : public QObject {
    Q_OBJECT
public:
    ONE(QGCCorePlugin)
    QGCOptions *options() { static QGCOptions options; return &options; }
    template <typename... Any> bool mavlinkMessage(const Any &...) { return true; }
    bool showAdvancedUI() const { return true; }
signals:
    void showAdvancedUIChanged(bool shown);
};
class QGCPositionManager : public QObject {
    Q_OBJECT
public:
    ONE(QGCPositionManager)
    QGeoCoordinate gcsPosition() { return {}; }
signals:
    void gcsPositionChanged(QGeoCoordinate position);
};
class TerrainAtCoordinateQuery : public QObject {
    Q_OBJECT
public:
    explicit TerrainAtCoordinateQuery(bool) {}
    void requestData(const QList<QGeoCoordinate> &) {}
signals:
    void terrainDataReceived(bool success, QList<double> heights);
};
class TrajectoryPoints : public QObject {
    Q_OBJECT
public:
    TrajectoryPoints(Vehicle *, QObject *parent) : QObject(parent) {}
    void start() {}
    void stop() {}
public slots:
    void clear() {}
};
class ImageProtocolManager : public QObject {
    Q_OBJECT
public:
    using QObject::QObject;
    Q_INVOKABLE void mavlinkMessageReceived(const mavlink_message_t &) {}
    uint32_t flowImageIndex() { return 0; }
signals:
    void imageReady(const QImage &image);
    void flowImageIndexChanged(uint32_t index);
};
class EventHandler : public QObject {
public:
    bool healthAndArmingChecksSupported() const { return false; }
};
namespace events::parser { class ParsedEvent {}; }
class HealthAndArmingCheckReport : public QObject { Q_OBJECT };
#define IDLE(type) class type : public QObject { Q_OBJECT public: type() {} \
    template <typename... Any> explicit type(Vehicle *, Any &&...) {} \
    template <typename... Any> bool mavlinkMessageReceived(const Any &...) { return true; }
IDLE(Actuators) void load(const QString &) {} };
IDLE(Autotune) };
IDLE(GimbalController) };
IDLE(Joystick) };
IDLE(MAVLinkLogManager) };
IDLE(RemoteIDManager) };
IDLE(TerrainProtocolHandler) };
IDLE(VehicleObjectAvoidance) void update(mavlink_obstacle_distance_t *) {} };
IDLE(QGCCameraManager) QVariantList &cameraList() { static QVariantList none; return none; } };
class JoystickManager { public: ONE(JoystickManager) bool joystickEnabledForVehicle(Vehicle *) { return false; } };
class VideoManager { public: ONE(VideoManager) void stopVideo() {} };
class ADSBVehicleManager { public: ONE(ADSBVehicleManager) void mavlinkMessageReceived(const mavlink_message_t &) {} };
class PlanMasterController { public: static void sendPlanToVehicle(Vehicle *, const QString &) {} };
class MockLink {};
namespace QGCDeviceInfo {
class QGCPressure { public: ONE(QGCPressure) double pressure() { return 0; } double temperature() { return 0; } };
}
namespace MAVLinkSigning {
inline void createSetupSigning(mavlink_channel_t, mavlink_system_t, mavlink_setup_signing_t &) {}
}
namespace FollowMe {
enum { POS = 1, VEL = 2, HEADING = 4 };
struct GCSMotionReport {
    int lat_int, lon_int;
    double altMetersAMSL, headingDegrees, vxMetersPerSec, vyMetersPerSec, vzMetersPerSec, pos_std_dev[3];
};
}
namespace QGCFileHelper {
inline QByteArray readFile(const QString &name, QString *) {
    QFile file(name);
    file.open(QIODevice::ReadOnly);
    return file.readAll();
}
}
namespace QGCNetworkHelper {
inline QJsonDocument parseCompressedJson(const QByteArray &text, QJsonParseError *error) { return QJsonDocument::fromJson(text, error); }
}

#define FACTS(type) class type : public FactGroup { Q_OBJECT public: \
    explicit type(QObject *parent = nullptr) : FactGroup(1000, parent) {}
FACTS(VehicleGPSFactGroup) };
FACTS(VehicleGPS2FactGroup) };
FACTS(VehicleGPSAggregateFactGroup) void bindToGps(FactGroup *, FactGroup *) {} };
FACTS(VehicleWindFactGroup) };
FACTS(VehicleVibrationFactGroup) };
FACTS(VehicleTemperatureFactGroup) };
FACTS(VehicleClockFactGroup) };
FACTS(VehicleSetpointFactGroup) };
FACTS(VehicleDistanceSensorFactGroup) };
FACTS(VehicleLocalPositionFactGroup) };
FACTS(VehicleLocalPositionSetpointFactGroup) };
FACTS(VehicleEstimatorStatusFactGroup) };
FACTS(VehicleHygrometerFactGroup) };
FACTS(VehicleGeneratorFactGroup) };
FACTS(VehicleEFIFactGroup) };
FACTS(VehicleRPMFactGroup) };
FACTS(TerrainFactGroup) };
class BatteryFactGroupListModel : public QmlObjectListModel {
    Q_OBJECT
public:
    void handleMessageForFactGroupCreation(Vehicle *, const mavlink_message_t &) {}
};
using EscStatusFactGroupListModel = BatteryFactGroupListModel;

class FirmwarePlugin;
class FirmwarePluginManager : public QObject {
    Q_OBJECT
public:
    ONE(FirmwarePluginManager)
    FirmwarePlugin *firmwarePluginForAutopilot(MAV_AUTOPILOT autopilot, MAV_TYPE type);
};

#include "Vehicle.h"
