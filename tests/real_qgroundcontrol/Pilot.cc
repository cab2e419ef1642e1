// SPDX-License-Identifier: GPL-3.0-or-later
// A pilot at QGroundControl. Reads a command from each line of standard input, ends each with a line "done".

#include <QtQml/QJSEngine>
#include <cstdio>

#include "ArduCopterFirmwarePlugin.h"
#include "GeoFenceManager.h"
#include "MissionManager.h"
#include "ParameterManager.h"
#include "RallyPointManager.h"
#include "Vehicle.h"

void tell(const QString &kind, QString text) {
    printf("%s\t%s\n", qPrintable(kind), qPrintable(text.replace("\n", "\\n")));
    fflush(stdout);
}

LinkInterface::LinkInterface(int port) {
    _socket.bind(QHostAddress::LocalHost, port);
    connect(&_socket, &QUdpSocket::readyRead, this, &LinkInterface::_read);
}

void LinkInterface::_read() {
    while (_socket.hasPendingDatagrams()) {
        QHostAddress host;
        quint16 port;
        QByteArray data(_socket.pendingDatagramSize(), 0);
        _socket.readDatagram(data.data(), data.size(), &host, &port);
        _peers.insert({host, port});
        MAVLinkProtocol::instance()->receiveBytes(this, data);
    }
}

void LinkInterface::writeBytesThreadSafe(const char *bytes, int length) {
    for (const auto &[host, port] : _peers) _socket.writeDatagram(bytes, length, host, port);
}

/// As MAVLinkProtocol::receiveBytes and _logData do it.
void MAVLinkProtocol::receiveBytes(LinkInterface *link, const QByteArray &data) {
    for (uint8_t byte : data) {
        mavlink_message_t message{};
        mavlink_status_t status{};
        if (mavlink_parse_char(link->mavlinkChannel(), byte, &message, &status) != MAVLINK_FRAMING_OK) continue;
        if (message.msgid != MAVLINK_MSG_ID_HEARTBEAT && (status.flags & MAVLINK_STATUS_FLAG_IN_MAVLINK1)) continue;
        if (message.msgid == MAVLINK_MSG_ID_HEARTBEAT) MultiVehicleManager::instance()->heartbeat(link, message);
        emit messageReceived(link, message);
    }
}

FirmwarePlugin *FirmwarePluginManager::firmwarePluginForAutopilot(MAV_AUTOPILOT, MAV_TYPE) {
    static ArduCopterFirmwarePlugin plugin;
    return &plugin;
}

class Pilot : public QObject {
public:
    Pilot() {
        connect(&_heartbeats, &QTimer::timeout, this, &Pilot::_sendHeartbeat);
        connect(&_watch, &QTimer::timeout, this, &Pilot::_look);
        connect(MultiVehicleManager::instance(), &MultiVehicleManager::activeVehicleChanged, this, &Pilot::_follow);
        QFile file(":/json/mainStatusText.js");
        file.open(QIODevice::ReadOnly);
        _engine.evaluate(file.readAll());
    }

    void obey(const QString &line) {
        const QStringList words = line.split('\t');
        const QString &verb = words[0];
        if (verb == "connect") {
            LinkManager::instance()->link = std::make_shared<LinkInterface>(words[1].toInt());
            _heartbeats.start(1000);
            return;
        }
        Vehicle *vehicle = MultiVehicleManager::instance()->vehicle;
        if (verb == "write") {
            QList<MissionItem *> items;
            for (int at = 2; at < words.count(); at++) items.append(_item(at - 2, words[at].split(' ')));
            _manager(words[1])->writeMissionItems(items);
        } else if (verb == "read") {
            _manager(words[1])->loadFromVehicle();
        } else if (verb == "clear") {
            _manager(words[1])->removeAll();
        } else if (verb == "resume") {
            vehicle->missionManager()->generateResumeMission(words[1].toInt());
        } else if (verb == "set") {
            Fact *fact = vehicle->parameterManager()->getParameter(ParameterManager::defaultComponentId, words[1]);
            fact->setRawValue(words[2].toDouble());
        } else if (verb == "parameters") {
            for (const auto &name : vehicle->parameterManager()->parameterNames(MAV_COMP_ID_AUTOPILOT1)) {
                Fact *fact = vehicle->parameterManager()->getParameter(MAV_COMP_ID_AUTOPILOT1, name);
                tell("parameter", name + " " + QString::number(fact->rawValue().toDouble(), 'g', 9));
            }
        } else if (verb == "arm") {
            vehicle->setArmedShowError(words[1] == "1");
        } else if (verb == "mode") {
            vehicle->setFlightMode(words[1]);
        } else if (verb == "takeoff") {
            vehicle->guidedModeTakeoff(10);
        } else if (verb == "land") {
            vehicle->guidedModeLand();
        } else if (verb == "goto") {
            vehicle->guidedModeGotoLocation(QGeoCoordinate(47.3985, 8.5465, 10));
        } else if (verb == "roi") {
            vehicle->guidedModeROI(QGeoCoordinate(47.3985, 8.5465, 10));
        } else if (verb == "sethome") {
            vehicle->sendMavCommand(vehicle->defaultComponentId(), MAV_CMD_DO_SET_HOME, true, 0, 0, 0, 0, 47.3985, 8.5465, 400);
        } else if (verb == "origin") {
            vehicle->setEstimatorOrigin(QGeoCoordinate(47.3985, 8.5465, 400));
        } else if (verb == "setwp") {
            vehicle->setCurrentMissionSequence(words[1].toInt());
        } else if (verb == "calibrate") {
            vehicle->startCalibration(static_cast<QGCMAVLink::CalibrationType>(words[1].toInt()));
        } else if (verb == "camera") {
            vehicle->triggerSimpleCamera();
        } else if (!QMetaObject::invokeMethod(vehicle, verb.toUtf8().constData())) {
            tell("error", verb);
        }
        tell("done", line);
    }

private:
    PlanManager *_manager(const QString &type) {
        Vehicle *vehicle = MultiVehicleManager::instance()->vehicle;
        if (type == "FENCE") return vehicle->geoFenceManager();
        if (type == "RALLY") return vehicle->rallyPointManager();
        return vehicle->missionManager();
    }

    /// command frame param1 ... param4 latitude longitude altitude
    static MissionItem *_item(int sequence, const QStringList &words) {
        double v[9];
        for (int at = 0; at < 9; at++) v[at] = words[at].toDouble();
        return new MissionItem(sequence, MAV_CMD(v[0]), MAV_FRAME(v[1]), v[2], v[3], v[4], v[5], v[6], v[7], v[8], true, false);
    }

    /// As MultiVehicleManager::_sendGCSHeartbeat.
    void _sendHeartbeat() {
        mavlink_message_t message;
        mavlink_msg_heartbeat_pack_chan(255, MAV_COMP_ID_MISSIONPLANNER, 0, &message, MAV_TYPE_GCS, MAV_AUTOPILOT_INVALID,
            MAV_MODE_MANUAL_ARMED, 0, MAV_STATE_ACTIVE);
        uint8_t buffer[MAVLINK_MAX_PACKET_LEN];
        int length = mavlink_msg_to_send_buffer(buffer, &message);
        LinkManager::instance()->link->writeBytesThreadSafe(reinterpret_cast<char *>(buffer), length);
    }

    void _follow(Vehicle *vehicle) {
        _watch.start(20);
        _vehicle = _engine.newQObject(vehicle);
        QJSEngine::setObjectOwnership(vehicle, QJSEngine::CppOwnership);
        connect(vehicle, &Vehicle::initialConnectComplete, this, [] { tell("done", "connect"); });
        connect(vehicle, &Vehicle::textMessageReceived, this,
            [](int, int, int severity, const QString &text, const QString &) { tell("message", QString("%1 %2").arg(severity).arg(text)); });
        for (const QString &type : {"MISSION", "FENCE", "RALLY"}) {
            PlanManager *manager = _manager(type);
            connect(manager, &PlanManager::inProgressChanged, this, [this, type, manager](bool busy) {
                if (!busy) QTimer::singleShot(0, this, [type, manager] { _ended(type, manager); });
            });
            connect(manager, &PlanManager::error, this, [type](int, const QString &text) { tell("failed", type + " " + text); });
        }
        connect(vehicle->parameterManager(), &ParameterManager::_paramSetSuccess, this, [](int, const QString &name) { tell("set", name); });
        connect(vehicle->parameterManager(), &ParameterManager::_paramSetFailure, this, [](int, const QString &name) { tell("unset", name); });
    }

    static void _ended(const QString &type, PlanManager *manager) {
        for (MissionItem *item : manager->missionItems())
            tell("item", QString("%1 %2 %3 %4 %5 %6 %7 %8 %9").arg(item->command()).arg(item->frame()).arg(item->param1())
                .arg(item->param2()).arg(item->param3()).arg(item->param4()).arg(item->param5(), 0, 'f', 7)
                .arg(item->param6(), 0, 'f', 7).arg(item->param7()));
        tell("ended", type);
    }

    /// What the toolbar shows, whenever it changes.
    void _look() {
        Vehicle *vehicle = MultiVehicleManager::instance()->vehicle;
        _engine.globalObject().setProperty("_activeVehicle", _vehicle);
        _engine.globalObject().setProperty("_communicationLost", vehicle->vehicleLinkManager()->communicationLost());
        const QList<QPair<QString, QString>> now = {
            {"status", _engine.evaluate("mainStatusText()").toString()},
            {"colour", _engine.globalObject().property("_mainStatusBGColor").toString()},
            {"mode", vehicle->flightMode()}, {"prearm", vehicle->prearmError()},
            {"index", QString::number(vehicle->missionManager()->currentIndex())},
            {"healthy", vehicle->allSensorsHealthy() ? "True" : "False"},
        };
        for (const auto &[kind, text] : now) {
            if (_shown.contains(kind) && _shown[kind] == text) continue;
            _shown[kind] = text;
            tell(kind, text);
        }
    }

    QTimer _heartbeats, _watch;
    QJSEngine _engine;
    QJSValue _vehicle;
    QMap<QString, QString> _shown;
};

void MultiVehicleManager::heartbeat(LinkInterface *link, const mavlink_message_t &message) {
    mavlink_heartbeat_t heartbeat;
    mavlink_msg_heartbeat_decode(&message, &heartbeat);
    if (vehicle || message.compid != MAV_COMP_ID_AUTOPILOT1 || heartbeat.autopilot == MAV_AUTOPILOT_INVALID) return;
    vehicle = new Vehicle(link, message.sysid, message.compid, MAV_AUTOPILOT(heartbeat.autopilot), MAV_TYPE(heartbeat.type));
    _vehicles.append(vehicle);
    emit activeVehicleChanged(vehicle);
}

int main(int count, char **words) {
    QGCApplication application(count, words);
    qRegisterMetaType<mavlink_message_t>("mavlink_message_t");
    Pilot pilot;
    QSocketNotifier input(0, QSocketNotifier::Read);
    QFile lines;
    lines.open(0, QIODevice::ReadOnly | QIODevice::Unbuffered);
    QObject::connect(&input, &QSocketNotifier::activated, &pilot, [&] {
        const QByteArray line = lines.readLine();
        if (line.isEmpty()) application.quit();
        else pilot.obey(QString::fromUtf8(line).trimmed());
    });
    return application.exec();
}
